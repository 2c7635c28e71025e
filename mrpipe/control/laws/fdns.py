"""Friction damping with negative stiffness."""

from __future__ import annotations

from mrpipe.control.law import Law
from mrpipe.control.laws._friction import (
    C_BODY,
    FRICTION,
    friction_assessment,
    friction_candidates,
    friction_force,
    friction_in_harmonic_motion,
)

LAW = Law(
    name="fdns",
    summary="friction damping with negative stiffness",
    source="thesis (4.18) to (4.25); P2 (20)",
    force=friction_force,
    c_body=C_BODY,
    gains=(FRICTION,),
    signs={"alpha_n_m": 1.0},
    candidates=friction_candidates,
    assess=friction_assessment,
    harmonic_force=friction_in_harmonic_motion,
    tuned_gain="alpha_n_m",
)
