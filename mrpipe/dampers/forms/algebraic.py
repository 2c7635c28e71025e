"""Algebraic model: a root function with free sharpness instead of a hyperbolic tangent, shifted with displacement."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Parameter, Values, shape
from mrpipe.dampers.plant import DISPLACEMENT, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.dampers.viscoplastic import knee


@njit(STEP_SIGNATURE, cache=True)
def algebraic_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: velocity scale [m/s], frequency [1/s] that weights the displacement, sharpness of the knee."""
    ratio = (wire[VELOCITY] + parameters[1] * wire[DISPLACEMENT]) / parameters[0]
    wire[HYSTERESIS] = knee(ratio, parameters[2])


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["velocity_scale"], values["frequency"], values.get("sharpness", 2.0)])
    return [Step("algebraic", Phase.HYSTERESIS, algebraic_step, numbers)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    ratio = at.speed / values["velocity_scale"]
    sharpness = values.get("sharpness", 2.0)
    return rounded_sum((1.0 + np.maximum(ratio, 1e-12) ** -sharpness) ** (-1.0 / sharpness), at)


FORM = BaseForm(
    name="algebraic",
    summary="F_y r/(1 + |r|^n)^(1/n) + c0 v, r = (v + w x)/v0",
    source="Guo, Yang, Pan 2006, J. Intell. Mater. Syst. Struct. 17, 3-14 (argument); Ramberg, Osgood 1943 (sharpness)",
    parameters=(
        shape("velocity_scale", "m/s", "speed over which the force reverses", "speed", 3e-3, 2.0, (0.1, 0.3, 0.03)),
        Parameter("frequency", "1/s", "weight of the displacement", "speed/stroke", 0.0, 2.0, (0.05, 0.3)),
        shape("sharpness", "1", "n: 2 is a square root, infinity a sharp knee", "one", 1.0, 12.0, (2.0,)),
    ),
    steps=_steps,
    post_yield=_post_yield,
)
