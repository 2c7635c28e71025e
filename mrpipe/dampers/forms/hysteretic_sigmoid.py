"""Hysteretic sigmoid model."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Parameter, Values, shape
from mrpipe.dampers.plant import HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.dampers.viscoplastic import direction_of_change


@njit(STEP_SIGNATURE, cache=True)
def hysteretic_sigmoid_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: velocity scale, hysteresis velocity [m/s]. State: last velocity, direction of its change."""
    late = wire[VELOCITY] - parameters[1] * direction_of_change(wire, state)
    # (1 - e^-r)/(1 + e^-r) = tanh(r/2), the scale holds the factor 2
    wire[HYSTERESIS] = math.tanh(late / parameters[0])


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["velocity_scale"], values["hysteresis_velocity"]])
    return [Step("hysteretic-sigmoid", Phase.HYSTERESIS, hysteretic_sigmoid_step, numbers, 2)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    scale, late = values["velocity_scale"], values["hysteresis_velocity"]
    return rounded_sum(0.5 * (np.tanh((at.speed - late) / scale) + np.tanh((at.speed + late) / scale)), at)


FORM = BaseForm(
    name="hysteretic-sigmoid",
    summary="F_y (1 - e^-r)/(1 + e^-r) + c0 v, r = 2 (v - v_h sign v')/v0",
    source="Wang, Ma, Rakheja, Su 2004, Proc. IMechE D 218, 1235-1247; Ma, Wang, Rakheja, Su 2002",
    parameters=(
        shape("velocity_scale", "m/s", "speed over which the force reverses", "speed", 3e-3, 2.0, (0.1, 0.3, 0.03)),
        Parameter("hysteresis_velocity", "m/s", "shift of the branches", "speed", 0.0, 0.5, (0.03, 0.1)),
    ),
    steps=_steps,
    post_yield=_post_yield,
)
