"""Biviscous model."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import CURRENT, HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_LOSS, Phase, Step
from mrpipe.dampers.yield_velocity import BEND, LARGEST_DRIVE, REST, growth_of, width_of, yield_velocity


@njit(STEP_SIGNATURE, cache=True)
def biviscous_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: yield velocity [m/s] at the largest drive, its share without drive, power, largest drive."""
    rest, bend, largest = parameters[1], parameters[2], parameters[3]
    width = yield_velocity(parameters[0], wire[CURRENT], wire[YIELD_LOSS], rest, bend, largest)
    wire[HYSTERESIS] = min(max(wire[VELOCITY] / width, -1.0), 1.0)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["yield_velocity"], *growth_of(values)])
    return [Step("biviscous", Phase.HYSTERESIS, biviscous_step, numbers)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum(np.minimum(at.speed / width_of(values, at), 1.0), at)


FORM = BaseForm(
    name="biviscous",
    summary="two viscosities: F_y v/v_y + c0 v below the yield velocity v_y(u), F_y + c0 v beyond it",
    source="Stanway, Sproston, El-Wahed 1996, Smart Mater. Struct. 5, 464-482; Wereley, Pang, Kamath 1998",
    parameters=(
        shape("yield_velocity", "m/s", "speed at which it yields", "speed", 1e-3, 1.0, (0.05, 0.2, 0.01)),
        REST,
        BEND,
        LARGEST_DRIVE,
    ),
    steps=_steps,
    post_yield=_post_yield,
)
