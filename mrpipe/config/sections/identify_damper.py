"""Settings of the stage `identify-damper`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from mrpipe.artifacts.yaml_source import nearest
from mrpipe.dampers.forms import form_names
from mrpipe.fitting.settings import DamperFitSettings


class IdentifyDamperSettings(DamperFitSettings):
    """Which parametric damper is fitted to the bench tests, and how."""

    form_files: tuple[Path, ...] = Field(
        (), description="Your Python files, each of which defines one more base form as FORM."
    )
    form: str = Field(
        "bouc-wen",
        description="Form of the damper that later stages use: one by name (bouc-wen is the thesis' simplified "
        "Bouc-Wen, 2.1 to 2.4; mrpipe/dampers/forms holds all), or best: the one with the fewest parameters within one "
        "standard error of the smallest cross-validated error on the training tests.",
    )
    compare: tuple[str, ...] = Field(
        (),
        description="Forms that are compared; empty for all of the library. Every form is ranked on a share of the "
        "samples, those near the best are fitted to all and judged on the validation tests.",
    )
    smooth_motion: bool = Field(
        True,
        description="Low-pass the displacement of periodic tests where it sinks into its noise (zero phase): at a "
        "reversal micrometres of noise become newtons and bias the shape of the hysteresis.",
    )
    force: Literal["filtered", "raw"] = Field(
        "filtered", description="The measured force to fit and to judge by: as prepared, or without its low-pass."
    )
    folds: int = Field(5, ge=2, le=20, description="Parts of the cross-validation where form is best.")
    reference_A: float = Field(  # noqa: N815 - the thesis' symbol
        1000.0,
        gt=0.0,
        description="A of (2.2) for which alpha, gamma and beta are reported: measurements determine only three of "
        "the four.",
    )

    @field_validator("form", "compare")
    @classmethod
    def _forms_are_known(cls, value: str | tuple[str, ...], info: ValidationInfo) -> str | tuple[str, ...]:
        # a user's own file may define any name: it is looked at when the stage is checked
        if not info.data.get("form_files"):
            known = form_names()
            for name in (value,) if isinstance(value, str) else value:
                if name not in known and name != "best":
                    raise ValueError(f"no base form {name!r}; {nearest(name, known)}")
        return value
