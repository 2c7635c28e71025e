"""Hysteretic biviscous model."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.hysteresis import ACCELERATION_SCALE, HYSTERESIS_VELOCITY
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import ACCELERATION, CURRENT, HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_LOSS, Phase, Step
from mrpipe.dampers.viscoplastic import rounded_sign
from mrpipe.dampers.yield_velocity import BEND, LARGEST_DRIVE, REST, growth_of, width_of, yield_velocity

NUMBERS = ("yield_velocity", "hysteresis_velocity", "acceleration_scale")


@njit(STEP_SIGNATURE, cache=True)
def hysteretic_biviscous_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: yield velocity at the largest drive, hysteresis velocity [m/s], acceleration scale [m/s^2], share of
    the yield velocity without drive, power, largest drive.
    """
    late = wire[VELOCITY] - parameters[1] * rounded_sign(wire[ACCELERATION], parameters[2])
    rest, bend, largest = parameters[3], parameters[4], parameters[5]
    width = yield_velocity(parameters[0], wire[CURRENT], wire[YIELD_LOSS], rest, bend, largest)
    wire[HYSTERESIS] = min(max(late / width, -1.0), 1.0)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([*(values[name] for name in NUMBERS), *growth_of(values)])
    return [Step("hysteretic-biviscous", Phase.HYSTERESIS, hysteretic_biviscous_step, numbers)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    width, late = width_of(values, at), values["hysteresis_velocity"]
    both = [np.clip((at.speed - side * late) / width, -1.0, 1.0) for side in (-1.0, 1.0)]
    return rounded_sum(0.5 * (both[0] + both[1]), at)


FORM = BaseForm(
    name="hysteretic-biviscous",
    summary="biviscous, its branches shifted by v_h tanh(v'/a0); v_y grows with the drive",
    source="Wereley, Pang, Kamath 1998, J. Intell. Mater. Syst. Struct. 9, 642-649; Pang, Kamath, Wereley 1998",
    parameters=(
        shape("yield_velocity", "m/s", "speed at which it yields", "speed", 1e-3, 1.0, (0.05, 0.2)),
        HYSTERESIS_VELOCITY,
        ACCELERATION_SCALE,
        REST,
        BEND,
        LARGEST_DRIVE,
    ),
    steps=_steps,
    post_yield=_post_yield,
)
