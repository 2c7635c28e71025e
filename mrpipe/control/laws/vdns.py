"""Viscous damping with negative stiffness."""

from __future__ import annotations

from mrpipe.control.law import Law
from mrpipe.control.laws._linear import (
    C_BODY,
    NEGATIVE_STIFFNESS,
    VISCOSITY,
    linear_assessment,
    linear_candidates,
    linear_force,
    linear_in_harmonic_motion,
)

LAW = Law(
    name="vdns",
    summary="viscous damping with negative stiffness",
    source="thesis (4.14) to (4.17); P2 (22)",
    force=linear_force,
    c_body=C_BODY,
    gains=(VISCOSITY, NEGATIVE_STIFFNESS),
    signs={"c_n_s_m": 1.0, "k_n_m": -1.0},
    candidates=lambda plant: linear_candidates(plant, plant.stiffness_n_m["vdns"]),
    assess=linear_assessment,
    harmonic_force=linear_in_harmonic_motion,
    linear=True,
    tuned_gain="c_n_s_m",
)
