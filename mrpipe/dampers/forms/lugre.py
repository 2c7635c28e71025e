"""LuGre model for MR dampers."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import YIELD_DISPLACEMENT, hysteresis
from mrpipe.dampers.parameters import Values, constant
from mrpipe.dampers.plant import HYSTERESIS, PART, STEP_SIGNATURE, VELOCITY, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def bristle_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: reference velocity [m/s]."""
    speed = wire[VELOCITY]
    wire[PART] = (speed - abs(speed) * wire[HYSTERESIS]) / parameters[0]


def _steps(values: Values) -> list[Step]:
    bristles = Step("bristle-damping", Phase.HYSTERESIS, bristle_step, np.array([values["reference_velocity"]]))
    return [hysteresis(values["yield_displacement"], 1.0, 1.0), bristles]


FORM = BaseForm(
    name="lugre",
    summary="bristles z' = v - |v| z/x_y with internal damping: F_y(u) z/x_y + F_b(u) z'/v_ref + c0 v",
    source="Jimenez and Alvarez-Icaza 2005, Struct. Control Health Monit. 12, 91-116 (constant damping); Canudas de "
    "Wit et al. 1995; in models of MR dampers the damping is constant or grows with the yield force",
    parameters=(
        YIELD_DISPLACEMENT,
        constant("reference_velocity", "m/s", "velocity of the bristles for which F_b is given", "speed"),
    ),
    steps=_steps,
    part="bristle_force",
)
