"""Settings of the fit of a damper model. They are also the defaults of :mod:`mrpipe.fitting`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from mrpipe.artifacts.yaml_source import nearest
from mrpipe.dampers.forms import form_names
from mrpipe.options import Section

BEST = "best"
"""Value of `form` with which the comparison chooses the form."""

ASSUMED_ETA = 100.0
"""Rate of the lag of the drive [1/s] that is assumed if the tests do not determine it."""


class DamperFitSettings(Section):
    """How parametric damper models are fitted to the bench tests."""

    drive_law: Literal["cross-validated", "polynomial"] = Field(
        "cross-validated",
        description="How yield force and viscosity depend on the drive. cross-validated: the law with the fewest "
        "coefficients that predicts levels of drive left out of the fit, among constant, linear, polynomial, monotone "
        "and saturating laws (tanh, Langevin, Froehlich), none of them negative. polynomial: polynomials of the "
        "degrees below.",
    )
    method: Literal["least-squares", "nelder-mead"] = Field(
        "least-squares",
        description="least-squares: Levenberg-Marquardt over the nonlinear parameters; the linear ones are solved for "
        "exactly. nelder-mead: the simplex search of section 2.2 of the thesis, restarted until the error no longer "
        "falls (slow).",
    )
    starts: int = Field(2, ge=1, le=20, description="Number of starts of each form whose search is completed.")
    yield_order: int = Field(
        3,
        ge=0,
        le=5,
        description="Largest degree of the yield force in the drive (2.3); it is reduced if the levels of drive do "
        "not determine it.",
    )
    viscosity_order: int = Field(
        1,
        ge=0,
        le=3,
        description="Largest degree of the viscosity in the drive (2.3); it is reduced if the levels of drive do not "
        "determine it.",
    )
    cycles: int = Field(2, ge=0, description="Number of steady cycles of each periodic test that are fitted; 0: all.")
    maximum_samples: int = Field(
        30_000,
        ge=500,
        description="Approximate number of samples at which forces are compared; the model runs at the full rate.",
    )
    offset_per_test: bool = Field(
        True,
        description="Whether the force has a separate offset in each training test, in addition to the one that "
        "prepare removed; otherwise one offset for all tests.",
    )
    equal_tests: bool = Field(
        False,
        description="Whether each test is weighted by its own RMS force, so that tests with small and large forces "
        "have equal weight.",
    )
    assumed_eta_per_s: float = Field(
        ASSUMED_ETA,
        gt=0.0,
        description="Rate of the lag of the drive (2.4) that is assumed if the drive is constant in every test, "
        "because such tests do not determine it.",
    )


class IdentifyDamperSettings(DamperFitSettings):
    """Which parametric damper model is fitted to the bench tests, and how."""

    form_files: tuple[Path, ...] = Field(
        (), description="Your Python files, each of which defines one more base form as FORM."
    )
    form: str = Field(
        "bouc-wen",
        description="Base form of the damper that later stages use. Either a name (bouc-wen is the simplified "
        "Bouc-Wen model of the thesis, (2.1) to (2.4); mrpipe/dampers/forms holds all forms), or best: the form with "
        "the fewest parameters within one standard error of the smallest cross-validated error on the training tests.",
    )
    compare: tuple[str, ...] = Field(
        (),
        description="Forms that are compared; empty: all forms of the library. Every form is ranked on a share of the "
        "samples. The best forms are fitted to all samples and judged on the validation tests.",
    )
    smooth_motion: bool = Field(
        True,
        description="Whether the displacement of periodic tests is low-passed (zero phase) above the frequency at "
        "which noise exceeds it. At a reversal micrometres of noise cause newtons of force and bias the shape of the "
        "hysteresis.",
    )
    force: Literal["filtered", "raw"] = Field(
        "filtered",
        description="Measured force that is fitted and judged: as prepared, or without the low-pass of prepare.",
    )
    folds: int = Field(5, ge=2, le=20, description="Number of parts of the cross-validation, if form is best.")
    reference_A: float = Field(  # noqa: N815 - the thesis' symbol
        1000.0,
        gt=0.0,
        description="Value of A in (2.2) for which alpha, gamma and beta are reported, because measurements determine "
        "only three of the four.",
    )

    @field_validator("form", "compare")
    @classmethod
    def _forms_are_known(cls, value: str | tuple[str, ...], info: ValidationInfo) -> str | tuple[str, ...]:
        # a file of the user may define any name: it is read when the stage is checked
        if not info.data.get("form_files"):
            known = form_names()
            for name in (value,) if isinstance(value, str) else value:
                if name not in known and name != BEST:
                    raise ValueError(f"no base form {name!r}; {nearest(name, known)}")
        return value
