"""Viscous damping."""

from __future__ import annotations

from mrpipe.control.law import Law
from mrpipe.control.laws._linear import (
    C_BODY,
    VISCOSITY,
    linear_assessment,
    linear_candidates,
    linear_force,
    linear_in_harmonic_motion,
)

LAW = Law(
    name="vd",
    summary="viscous damping",
    source="thesis (4.11) to (4.13); P2 (13)",
    force=linear_force,
    c_body=C_BODY,
    gains=(VISCOSITY,),
    signs={"c_n_s_m": 1.0},
    candidates=lambda plant: linear_candidates(plant, 0.0),
    assess=linear_assessment,
    harmonic_force=linear_in_harmonic_motion,
    linear=True,
    tuned_gain="c_n_s_m",
)
