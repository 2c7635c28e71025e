"""Channel skew: displacement and force are not sampled at the same instant."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import ACCELERATION, DISPLACEMENT, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Values, strength


@njit(STEP_SIGNATURE, cache=True)
def shift_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: time [s] by which the displacement lies behind the force."""
    skew = parameters[0]
    wire[DISPLACEMENT] += skew * wire[VELOCITY] + 0.5 * skew * skew * wire[ACCELERATION]
    wire[VELOCITY] += skew * wire[ACCELERATION]


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
    ),
    sensor=True,
    separated_by={"inertia": "time-stamp check, frequency sweep", "backlash": "the same stroke at several frequencies"},
)
