"""Hysteretic sigmoid model."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.hysteresis import ACCELERATION_SCALE, HYSTERESIS_VELOCITY
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import ACCELERATION, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.dampers.viscoplastic import rounded_sign


@njit(STEP_SIGNATURE, cache=True)
def hysteretic_sigmoid_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: velocity scale, hysteresis velocity [m/s], acceleration scale [m/s^2]."""
    late = wire[VELOCITY] - parameters[1] * rounded_sign(wire[ACCELERATION], parameters[2])
    # (1 - e^-r)/(1 + e^-r) = tanh(r/2), the scale holds the factor 2
    wire[HYSTERESIS] = math.tanh(late / parameters[0])


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values[name] for name in ("velocity_scale", "hysteresis_velocity", "acceleration_scale")])
    return [Step("hysteretic-sigmoid", Phase.HYSTERESIS, hysteretic_sigmoid_step, numbers)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    scale, late = values["velocity_scale"], values["hysteresis_velocity"]
    return rounded_sum(0.5 * (np.tanh((at.speed - late) / scale) + np.tanh((at.speed + late) / scale)), at)


FORM = BaseForm(
    name="hysteretic-sigmoid",
    summary="F_y (1 - e^-r)/(1 + e^-r) + c0 v, r = 2 (v - v_h tanh(v'/a0))/v0",
    source="Wang, Ma, Rakheja, Su 2004, Proc. IMechE D 218, 1235-1247; Ma, Wang, Rakheja, Su 2002",
    parameters=(
        shape("velocity_scale", "m/s", "speed over which the force reverses", "speed", 3e-3, 2.0, (0.1, 0.3, 0.03)),
        HYSTERESIS_VELOCITY,
        ACCELERATION_SCALE,
    ),
    steps=_steps,
    post_yield=_post_yield,
)
