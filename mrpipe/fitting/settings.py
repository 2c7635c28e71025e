"""Settings of the fit of a damper: part of a section of the configuration, and defaults of :mod:`mrpipe.fitting`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section

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
