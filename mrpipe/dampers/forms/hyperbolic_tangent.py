"""Hyperbolic tangent model of Kwok et al."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Parameter, Values, amplitude, shape
from mrpipe.dampers.plant import DISPLACEMENT, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.dampers.viscoplastic import parallel_spring, rounded_sign


@njit(STEP_SIGNATURE, cache=True)
def hyperbolic_tangent_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: velocity scale [m/s], shift delta [1], displacement scale [m]."""
    side = rounded_sign(wire[DISPLACEMENT], parameters[2])
    wire[HYSTERESIS] = math.tanh(wire[VELOCITY] / parameters[0] + parameters[1] * side)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values[name] for name in ("velocity_scale", "shift", "displacement_scale")])
    return [
        Step("hyperbolic-tangent", Phase.HYSTERESIS, hyperbolic_tangent_step, numbers),
        parallel_spring(values.get("stiffness", 0.0)),
    ]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    ratio = at.speed / values["velocity_scale"]
    return rounded_sum(0.5 * (np.tanh(ratio + values["shift"]) + np.tanh(ratio - values["shift"])), at)


FORM = BaseForm(
    name="hyperbolic-tangent",
    summary="F_y tanh(v/v0 + delta tanh(x/x0)) + c0 v + k x",
    source="Kwok, Ha, Nguyen, Li, Samali 2006, Sens. Actuators A 132, 441-451",
    parameters=(
        shape("velocity_scale", "m/s", "speed over which the force reverses", "speed", 3e-3, 2.0, (0.1, 0.3, 0.03)),
        Parameter("shift", "1", "delta: width of the loop over velocity", "one", 0.0, 6.0, (0.5, 0.0)),
        shape(
            "displacement_scale",
            "m",
            "displacement over which the shift changes its sign",
            "stroke",
            1e-4,
            1.0,
            (0.03,),
        ),
        amplitude("stiffness", "N/m", "spring parallel to the damper", "force/stroke", 0.0, 10.0),
    ),
    steps=_steps,
    amplitude_steps={"stiffness": 1},
    post_yield=_post_yield,
    springs=("stiffness",),
)
