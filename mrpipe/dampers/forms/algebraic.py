"""Algebraic model: a root in place of a hyperbolic tangent, shifted in proportion to the displacement."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Parameter, Values, shape
from mrpipe.dampers.plant import DISPLACEMENT, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def algebraic_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: velocity scale [m/s], frequency [1/s] that weighs the displacement."""
    ratio = (wire[VELOCITY] + parameters[1] * wire[DISPLACEMENT]) / parameters[0]
    wire[HYSTERESIS] = ratio / math.sqrt(1.0 + ratio * ratio)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["velocity_scale"], values["frequency"]])
    return [Step("algebraic", Phase.HYSTERESIS, algebraic_step, numbers)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    ratio = at.speed / values["velocity_scale"]
    return rounded_sum(ratio / np.sqrt(1.0 + ratio**2), at)


FORM = BaseForm(
    name="algebraic",
    summary="F_y r/sqrt(1 + r^2) + c0 v, r = (v + w x)/v0",
    source="Guo, Yang, Pan 2006, J. Intell. Mater. Syst. Struct. 17, 3-14 (argument of the function)",
    parameters=(
        shape("velocity_scale", "m/s", "speed over which the force reverses", "speed", 3e-3, 2.0, (0.1, 0.3, 0.03)),
        Parameter("frequency", "1/s", "weight of the displacement", "speed/stroke", 0.0, 2.0, (0.05, 0.3)),
    ),
    steps=_steps,
    post_yield=_post_yield,
)
