"""Channel skew: displacement and force are not sampled at the same instant."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    ACCELERATION,
    CURRENT,
    DISPLACEMENT,
    DRIVE,
    FIRST,
    STEP_SIGNATURE,
    VELOCITY,
    Phase,
    Step,
)
from mrpipe.effects.contract import Effect, EffectForm, Values, strength


@njit(STEP_SIGNATURE, cache=True)
def shift_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: time [s] by which the displacement lies behind the force."""
    skew = parameters[0]
    wire[DISPLACEMENT] += skew * wire[VELOCITY] + 0.5 * skew * skew * wire[ACCELERATION]
    wire[VELOCITY] += skew * wire[ACCELERATION]


@njit(STEP_SIGNATURE, cache=True)
def late_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: time [s] by which the force lies behind displacement and drive. State: ring of drives, its place.

    The force is late by as much as motion and drive are taken from before.
    """
    skew = max(parameters[0], 0.0)
    wire[DISPLACEMENT] += -skew * wire[VELOCITY] + 0.5 * skew * skew * wire[ACCELERATION]
    wire[VELOCITY] -= skew * wire[ACCELERATION]
    size = state.shape[0] - 1
    if wire[FIRST] > 0.5:
        for index in range(size):
            state[index] = wire[DRIVE]
        state[size] = 0.0
    at = int(state[size])
    state[at] = wire[DRIVE]
    back = min(skew / dt, size - 2.0)
    whole = int(back)
    part = back - whole
    late = (1.0 - part) * state[(at - whole + size) % size] + part * state[(at - whole - 1 + size) % size]
    state[size] = (at + 1) % size
    wire[DRIVE] = late
    wire[CURRENT] = late


def _late(values: Values) -> list[Step]:
    return [Step("late-force", Phase.MOTION, late_force_step, np.array([values["skew"]]), 129)]


def _shift(values: Values) -> list[Step]:
    return [Step("channel-skew", Phase.MOTION, shift_step, np.array([values["skew"]]))]


EFFECT = Effect(
    name="channel-skew",
    summary="displacement and force do not belong to the same instant",
    physics="Channels are sampled one after another, or one of them goes through a filter that the other lacks.",
    remedy="Check time stamps with a common step on both inputs; give both channels the same filter.",
    source="multiplexed data loggers",
    acts_on="time base",
    forms=(
        EffectForm(
            "shift",
            "x(t + T)",
            (strength("skew", "s", "time that displacement lies behind force", "one", -0.03, 0.03, 0.0005),),
            _shift,
        ),
        EffectForm(
            "late-force",
            "F(t - T)",
            (strength("skew", "s", "time that force lies behind displacement and drive", "one", 0.0, 0.03, 0.0005),),
            _late,
        ),
    ),
    sensor=True,
    separated_by={"inertia": "time-stamp check, frequency sweep", "backlash": "the same stroke at several frequencies"},
)
