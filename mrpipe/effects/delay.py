"""Delay: the drive acts later than with the first-order lag of the model."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, FIRST, STEP_SIGNATURE, Phase, Step
from mrpipe.dampers.second_order import second_order_filter
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, shape, strength

BUFFER = 6144
"""Number of stored samples of the effective drive for the dead time."""


@njit(STEP_SIGNATURE, cache=True)
def dead_time_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: dead time [s]. State: ring buffer of past effective drives, write position."""
    size = state.shape[0] - 1
    u = wire[CURRENT]
    if wire[FIRST] > 0.5:
        for index in range(size):
            state[index] = u
        state[size] = 0.0
    at = int(state[size])
    state[at] = u
    back = min(parameters[0] / dt, size - 2.0)
    whole = int(back)
    part = back - whole
    first = state[(at - whole + size) % size]
    second = state[(at - whole - 1 + size) % size]
    state[size] = (at + 1) % size
    wire[CURRENT] = (1.0 - part) * first + part * second


@njit(STEP_SIGNATURE, cache=True)
def second_lag_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: time constants [s] rising and falling, largest slope [A/s] (0: none). State: output, last input."""
    u = wire[CURRENT]
    if wire[FIRST] > 0.5:
        state[0] = u
        state[1] = u
    rising, falling = parameters[0], parameters[1]
    constant = rising if u > state[0] else falling
    middle = 0.5 * (u + state[1])
    if constant > 1e-9:
        state[0] += (1.0 - math.exp(-dt / constant)) * (middle - state[0])
    else:
        state[0] = u
    state[1] = u
    wire[CURRENT] = state[0]


@njit(STEP_SIGNATURE, cache=True)
def second_order_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: delay 2 zeta/omega [s], damping ratio. State: that of :func:`second_order_filter`."""
    second_order_filter(state, wire[CURRENT], parameters[0], parameters[1], dt, int(wire[FIRST]))
    wire[CURRENT] = state[0]


def _dead_time(values: Values) -> list[Step]:
    delay = values["delay"]
    step = Step("dead-time", Phase.CURRENT_EFFECT, dead_time_step, np.array([delay]), BUFFER + 1)
    return [replace(step, back_s=delay, kept=BUFFER)]


def _lag(rising: float, falling: float) -> list[Step]:
    return [Step("second-lag", Phase.CURRENT_EFFECT, second_lag_step, np.array([rising, falling]), 2)]


def _second(values: Values) -> list[Step]:
    return _lag(values["time_constant"], values["time_constant"])


def _second_order(values: Values) -> list[Step]:
    numbers = np.array([values["delay"], values["damping_ratio"]])
    return [Step("second-order", Phase.CURRENT_EFFECT, second_order_step, numbers, 3)]


def _dead_time_and_lag(values: Values) -> list[Step]:
    lag = values["lag_share"] * values["delay"]
    return [*_dead_time({"delay": values["delay"] - lag}), *_lag(lag, lag)]


def _dead_time_and_second_order(values: Values) -> list[Step]:
    filtered = values["filter_share"] * values["delay"]
    rest = _second_order({"delay": filtered, "damping_ratio": values["damping_ratio"]})
    return [*_dead_time({"delay": values["delay"] - filtered}), *rest]


def _rise(values: Values) -> list[Step]:
    return _lag(values["rise_time"], 0.0)


def _fall(values: Values) -> list[Step]:
    return _lag(0.0, values["fall_time"])


EFFECT = Effect(
    name="delay",
    summary="the drive acts later than with the lag of the model",
    physics="Power electronics, eddy currents and the formation of particle chains cause dead time or a second lag.",
    remedy="Record the coil current at the damper, measure steps up and down at constant velocity, declare the lag.",
    residual="The measured force follows steps of the drive later than the model. At constant drive there is no "
    "residual.",
    source="Koo et al. 2006 on response time of MR dampers; eddy currents as a second pole",
    acts_on="effective drive",
    forms=(
        EffectForm("dead-time", "u(t - T)", (strength("delay", "s", "dead time", "one", 0.0, 0.5, 0.002),), _dead_time),
        EffectForm(
            "second-lag",
            "tau w' = u - w",
            (strength("time_constant", "s", "time constant", "one", 0.0, 0.5, 0.002),),
            _second,
        ),
        EffectForm(
            "second-order",
            "w'' + 2 zeta omega w' + omega^2 (w - u) = 0, T = 2 zeta/omega",
            (
                strength("delay", "s", "delay of slow changes", "one", 0.0, 0.5, 0.002),
                shape("damping_ratio", "1", "below 1 it overshoots", "one", 0.25, 3.0, (0.8,)),
            ),
            _second_order,
        ),
        EffectForm(
            "dead-time-and-lag",
            "tau w' = u(t - T + tau) - w, tau = s T",
            (
                strength("delay", "s", "dead time and time constant", "one", 0.0, 0.5, 0.002),
                shape("lag_share", "1", "share of the time constant", "one", 0.05, 0.95, (0.4,)),
            ),
            _dead_time_and_lag,
        ),
        EffectForm(
            "slow-rise",
            "tau w' = u - w while rising",
            (strength("rise_time", "s", "time constant when the drive rises", "one", 0.0, 0.5, 0.002),),
            _rise,
        ),
        EffectForm(
            "slow-fall",
            "tau w' = u - w while falling",
            (strength("fall_time", "s", "time constant when the drive falls", "one", 0.0, 0.5, 0.002),),
            _fall,
        ),
    ),
    needs=("varying-drive",),
    delays_of_drive=("delay", "time_constant", "rise_time", "fall_time"),
    separated_by={"remanence": Separation("current steps up and down at constant velocity", ("steps",))},
    refinements=(
        # a chain of any number of lags is similar to a dead time followed by a second-order filter
        EffectForm(
            "dead-time-and-second-order",
            "w'' + 2 zeta omega w' + omega^2 (w - u(t - T + s T)) = 0, s T = 2 zeta/omega",
            (
                strength("delay", "s", "delay of slow changes", "one", 0.0, 0.5, 0.002),
                shape("filter_share", "1", "share of the filter", "one", 0.05, 0.98, (0.7,)),
                shape("damping_ratio", "1", "below 1 it overshoots", "one", 0.25, 3.0, (0.8,)),
            ),
            _dead_time_and_second_order,
        ),
    ),
)
