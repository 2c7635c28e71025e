"""Settings of the fit of a damper: part of a section of the configuration, and defaults of :mod:`mrpipe.fitting`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from mrpipe.artifacts.yaml_source import nearest
from mrpipe.dampers.forms import form_names
from mrpipe.options import Section

BEST = "best"
"""In place of the name of a form: the comparison chooses."""

ASSUMED_ETA = 100.0
"""Rate of the drive's lag [1/s] of a damper whose tests do not determine it."""


class DamperFitSettings(Section):
    """How parametric dampers are fitted to the bench tests."""

    drive_law: Literal["cross-validated", "polynomial"] = Field(
        "cross-validated",
        description="How yield force and viscosity depend on the drive. cross-validated: the law with the fewest "
        "numbers that predicts levels of drive left out of the fit, among constant, linear, polynomial, monotone and "
        "saturating laws (tanh, Langevin, Froehlich), none of them negative. polynomial: of the degrees below.",
    )
    method: Literal["least-squares", "nelder-mead"] = Field(
        "least-squares",
        description="least-squares: trust region over the nonlinear parameters, linear ones projected out; "
        "nelder-mead: the simplex of thesis 2.2 in its place, restarted until it gains nothing (slow).",
    )
    starts: int = Field(2, ge=1, le=20, description="How many starts of each form are followed to the end.")
    yield_order: int = Field(
        3,
        ge=0,
        le=5,
        description="Largest degree of the yield force in the drive (2.3); lowered to what the levels determine.",
    )
    viscosity_order: int = Field(
        1,
        ge=0,
        le=3,
        description="Largest degree of the viscosity in the drive (2.3); lowered to what the levels determine.",
    )
    cycles: int = Field(2, ge=0, description="Steady cycles of each periodic test that the fit sees; 0 for all.")
    maximum_samples: int = Field(
        30_000, ge=500, description="Forces are compared at about so many samples; the model runs at the full rate."
    )
    offset_per_test: bool = Field(
        True,
        description="Fit an offset of the force in each training test, in addition to what prepare took out; else one "
        "for all tests.",
    )
    equal_tests: bool = Field(
        False, description="Weight each test by its own force, so that weak tests count as much as strong ones."
    )
    assumed_eta_per_s: float = Field(
        ASSUMED_ETA,
        gt=0.0,
        description="Rate of the drive's lag (2.4) given to the damper where every test holds the drive constant, "
        "because such tests do not determine it.",
    )


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
                if name not in known and name != BEST:
                    raise ValueError(f"no base form {name!r}; {nearest(name, known)}")
        return value
