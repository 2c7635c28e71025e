"""Settings of the stage `identify-damper`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.config.section import Section

FormName = Literal[
    "bouc-wen",
    "bouc-wen-n",
    "dahl",
    "bingham",
    "rounded-yield",
    "power-yield",
    "saturating-dashpot",
    "modified-bouc-wen",
]


class IdentifyDamperSettings(Section):
    """Which parametric damper is fitted to the bench tests, and how."""

    form: Literal[FormName, "best"] = Field(
        "bouc-wen",
        description="Form of the damper that later stages use: one by name (bouc-wen is the thesis' simplified "
        "Bouc-Wen, 2.1 to 2.4), or best: the one with the fewest parameters within one standard error of the smallest "
        "cross-validated error on the training tests.",
    )
    compare: tuple[FormName, ...] = Field(
        (
            "bouc-wen",
            "dahl",
            "bingham",
            "rounded-yield",
            "power-yield",
            "saturating-dashpot",
            "modified-bouc-wen",
        ),
        description="Forms that are fitted and compared by their error on the validation tests.",
    )
    method: Literal["least-squares", "nelder-mead"] = Field(
        "least-squares",
        description="least-squares: trust region over the nonlinear parameters, linear ones projected out; "
        "nelder-mead: the simplex of thesis 2.2 in its place, restarted until it gains nothing (over a minute for "
        "modified-bouc-wen).",
    )
    starts: int = Field(2, ge=1, le=20, description="How many starts of each form are followed to the end.")
    yield_order: int = Field(
        3, ge=0, le=3, description="Degree of the yield force in the drive (2.3); lowered to what the levels can tell."
    )
    viscosity_order: int = Field(
        1, ge=0, le=3, description="Degree of the viscosity in the drive (2.3); lowered to what the levels can tell."
    )
    smooth_motion: bool = Field(
        True,
        description="Low-pass the displacement of periodic tests where it sinks into its noise (zero phase): at a "
        "reversal micrometres of noise become newtons and bias the shape of the hysteresis.",
    )
    cycles: int = Field(2, ge=0, description="Steady cycles of each periodic test that the fit sees; 0 for all.")
    maximum_samples: int = Field(
        30_000, ge=500, description="Forces are compared at about so many samples; the model runs at the full rate."
    )
    force: Literal["filtered", "raw"] = Field(
        "filtered", description="The measured force to fit and to judge by: as prepared, or without its low-pass."
    )
    offset_per_test: bool = Field(
        True, description="Fit an offset of the force in each training test, beside what prepare took out."
    )
    equal_tests: bool = Field(
        False, description="Weight each test by its own force, so that weak tests count as much as strong ones."
    )
    assumed_eta_per_s: float = Field(
        100.0,
        gt=0.0,
        description="Rate of the drive's lag (2.4) given to the damper where every test holds the drive constant, so "
        "that measurements say nothing of it.",
    )
    folds: int = Field(5, ge=2, le=20, description="Parts of the cross-validation where form is best.")
    reference_A: float = Field(  # noqa: N815 - the thesis' symbol
        1000.0,
        gt=0.0,
        description="A of (2.2) for which alpha, gamma and beta are reported: only three of the four can be told.",
    )
