"""Channel skew: displacement and force are not sampled at the same instant."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, njit, void

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    ACCELERATION,
    CURRENT,
    DISPLACEMENT,
    DRIVE,
    FIRST,
    FORCE,
    STEP_SIGNATURE,
    VELOCITY,
    Phase,
    Step,
    idle_step,
)
from mrpipe.dampers.second_order import second_order_filter
from mrpipe.dampers.timing import between
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, shape, strength

INSTANTS = 1024
"""Number of stored instants for the late force."""
_KEPT = 4  # displacement, velocity, acceleration and drive of an instant


@njit(void(float64[::1], float64[::1], int64), cache=True)
def _keep(wire: FloatArray, state: FloatArray, place: int) -> None:
    state[_KEPT * place] = wire[DISPLACEMENT]
    state[_KEPT * place + 1] = wire[VELOCITY]
    state[_KEPT * place + 2] = wire[ACCELERATION]
    state[_KEPT * place + 3] = wire[DRIVE]


@njit(STEP_SIGNATURE, cache=True)
def late_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: time [s] by which the force is late. State: ring buffer of instants, write position.

    The force is computed from motion and drive at an earlier time, and is therefore late by this time.
    """
    size = (state.shape[0] - 1) // _KEPT
    if wire[FIRST] > 0.5:
        for index in range(size):
            _keep(wire, state, index)
        state[-1] = 0.0
    at = int(state[-1])
    _keep(wire, state, at)
    back = min(max(parameters[0], 0.0) / dt, size - 2.0)
    whole = int(back)
    part = back - whole
    new, old = _KEPT * ((at - whole + size) % size), _KEPT * ((at - whole - 1 + size) % size)
    wire[DISPLACEMENT] = between(state[new], state[old], -dt * state[new + 1], -dt * state[old + 1], part)
    wire[VELOCITY] = (1.0 - part) * state[new + 1] + part * state[old + 1]
    wire[ACCELERATION] = (1.0 - part) * state[new + 2] + part * state[old + 2]
    wire[DRIVE] = (1.0 - part) * state[new + 3] + part * state[old + 3]
    wire[CURRENT] = wire[DRIVE]
    state[-1] = (at + 1) % size


@njit(STEP_SIGNATURE, cache=True)
def filtered_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: delay [s], damping ratio. State: that of :func:`second_order_filter`."""
    second_order_filter(state, wire[FORCE], parameters[0], parameters[1], dt, int(wire[FIRST]))
    wire[FORCE] = state[0]


def _late(values: Values) -> list[Step]:
    skew = values["skew"]
    size = _KEPT * INSTANTS + 1
    return [Step("late-force", Phase.MOTION, late_force_step, np.array([skew]), size, back_s=skew, kept=INSTANTS)]


def _filtered(values: Values) -> list[Step]:
    numbers = np.array([values["skew"], values["damping_ratio"]])
    return [Step("filtered-force", Phase.SENSOR, filtered_force_step, numbers, 3, filters_force=True)]


def _shift(values: Values) -> list[Step]:
    return [Step("channel-skew", Phase.MOTION, idle_step, np.zeros(0), ahead_s=values["skew"])]


EFFECT = Effect(
    name="channel-skew",
    summary="displacement and force are not recorded at the same instant",
    physics="Channels are sampled one after another, or one of them goes through a filter that the other lacks.",
    remedy="Apply the same step signal to both inputs and compare the time stamps; give both channels the same filter.",
    residual="A loop over velocity that grows with frequency and vanishes where the force is constant; the measured "
    "loop is rotated relative to that of the model.",
    source="multiplexed data loggers; amplifiers with a low-pass filter",
    acts_on="time base",
    forms=(
        EffectForm(
            "shift",
            "x(t + T)",
            (strength("skew", "s", "delay of the displacement relative to the force", "one", -0.03, 0.03, 0.0005),),
            _shift,
        ),
        EffectForm(
            "late-force",
            "F(t - T)",
            (strength("skew", "s", "delay of the force relative to displacement and drive", "one", 0.0, 0.03, 0.0005),),
            _late,
        ),
        EffectForm(
            "filtered-force",
            "F_m'' + 2 zeta omega F_m' + omega^2 (F_m - F) = 0, T = 2 zeta/omega",
            (
                strength("skew", "s", "delay of slow changes of the force", "one", 0.0, 0.03, 0.0005),
                shape(
                    "damping_ratio", "1", "damping ratio of the filter of the force channel", "one", 0.5, 2.0, (0.8,)
                ),
            ),
            _filtered,
        ),
    ),
    sensor=True,
    separated_by={
        "inertia": Separation("check of the time stamps, frequency sweep", ("frequencies",)),
        "backlash": Separation("the same stroke at several frequencies", ("frequencies",)),
    },
)
