"""Remanence: the core stays magnetised after the current has fallen."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, FIRST, PAST_CURRENT, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Separation, Values, shape, strength


@njit(STEP_SIGNATURE, cache=True)
def remanence_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gain, length [m] or time [s] or width [A], kind, time [s]. State: memory, last effective drive.

    Kinds: 0 the memory follows a rising drive at once and decays with slip; 1 with time; 2 largest drive so far; 3 play
    of a width; 4 Bouc-Wen like memory that follows the direction of change of the drive; 5 to 9 time and slip together.
    """
    u = wire[CURRENT]
    gain, size, kind = parameters[0], parameters[1], parameters[2]
    if wire[FIRST] > 0.5:
        state[0] = u if kind != 4.0 else 0.0
        state[1] = u
    if kind == 0.0 or kind == 1.0:
        path = abs(wire[VELOCITY]) * dt if kind == 0.0 else dt
        state[0] = max(u, u + (state[0] - u) * math.exp(-path / size))
        wire[CURRENT] = u + gain * (state[0] - u)
    elif kind >= 5.0:
        # a memory that time and slip reduce together: to the drive (5), or to zero (6 to 9)
        path = abs(wire[VELOCITY]) * dt / size + dt / parameters[3]
        floor = u if kind == 5.0 else 0.0
        state[0] = max(u, floor + (state[0] - floor) * math.exp(-path))
        if kind == 5.0:
            wire[CURRENT] = u + gain * (state[0] - u)
        elif kind == 6.0:
            wire[CURRENT] = max(u, gain * state[0])
        elif kind == 9.0:
            wire[CURRENT] = math.sqrt(u * u + (gain * state[0]) ** 2)
        else:
            wire[CURRENT] = u + gain * (state[0] - u) * state[0] / (state[0] + abs(u) + 1e-12)
    elif kind == 2.0:
        largest = max(wire[PAST_CURRENT], abs(u))
        wire[CURRENT] = u + gain * (largest - u)
    elif kind == 3.0:
        state[0] = min(max(state[0], u), u + size)
        wire[CURRENT] = u + gain * (state[0] - u)
    else:
        change = u - state[1]
        direction = 1.0 if change > 0.0 else -1.0
        state[0] = direction + (state[0] - direction) * math.exp(-abs(change) / size)
        wire[CURRENT] = u - gain * size * state[0]
    if wire[CURRENT] < 0.0 and u >= 0.0:
        wire[CURRENT] = 0.0
    state[1] = u


_PLAYS = 5


@njit(STEP_SIGNATURE, cache=True)
def many_plays_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gain, largest width [A], exponent of the weights. State: the plays."""
    u = wire[CURRENT]
    total, weights = 0.0, 0.0
    for k in range(_PLAYS):
        if wire[FIRST] > 0.5:
            state[k] = u
        part = (k + 1.0) / _PLAYS
        state[k] = min(max(state[k], u), u + part * parameters[1])
        weight = part ** parameters[2]
        total += weight * (state[k] - u)
        weights += weight
    wire[CURRENT] = u + parameters[0] * total / weights


@njit(STEP_SIGNATURE, cache=True)
def remanent_field_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gain, length [m], time [s], exponent or width or limit, drive of reference, kind.

    State: m, peak, path.

    The memory m fades with time and slip together. It falls at a rate proportional to m^2 (kind 0), as peak/(1 + path)
    (1), or exponentially (2, 4); or it follows the drive in both directions (3). The effective drive is the larger of
    drive and memory, with a rounded corner (0, 4) or with a limited memory (1); the drive plus a part of the memory
    that decreases with the drive (2); or the drive plus a part of the excess of the memory over the drive that
    decreases with the drive (3).
    """
    u = wire[CURRENT]
    gain, size, kind = parameters[0], parameters[3], parameters[5]
    if wire[FIRST] > 0.5:
        state[0] = max(u, 0.0)
        state[1] = state[0]
        state[2] = 0.0
    path = abs(wire[VELOCITY]) * dt / parameters[1] + dt / parameters[2]
    if kind == 0.0:
        state[0] = state[0] / (1.0 + path * state[0] / parameters[4])
    elif kind == 1.0:
        state[2] += path
        state[0] = state[1] / (1.0 + state[2])
    elif kind == 2.0 or kind == 4.0:
        state[0] = state[0] * math.exp(-path)
    else:
        state[0] = u + (state[0] - u) * math.exp(-path)
    if u >= state[0] and kind != 3.0:
        state[0] = u
        state[1] = u
        state[2] = 0.0
    held = gain * state[0]
    if held <= 0.0:
        return
    # a recorded drive of zero has noise of both signs, and the remanence is unchanged below zero
    positive = max(u, 0.0)
    if kind == 0.0 or kind == 4.0:
        larger, ratio = max(positive, held), min(positive, held) / max(positive, held)
        wire[CURRENT] = larger * (1.0 + ratio**size) ** (1.0 / size)
    elif kind == 1.0:
        wire[CURRENT] = max(positive, size * math.tanh(held / size))
    elif kind == 2.0:
        wire[CURRENT] = u + held * math.exp(-positive / size)
    elif state[0] > u:
        wire[CURRENT] = u + gain * (state[0] - u) / (1.0 + (u / size) ** 2)


@njit(STEP_SIGNATURE, cache=True)
def charging_field_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gain, limit [A], charging time [s], length [m], time [s], power of fading, corner.

    State: remanent field.

    The remanent field follows a saturating function of the drive with a lag, and fades with slip and time, faster if it
    is larger. The effective drive is the larger of drive and remanent field, with a rounded corner.
    """
    u = wire[CURRENT]
    gain, limit, corner = parameters[0], parameters[1], parameters[6]
    level = min(gain * u / (1.0 + max(u, 0.0) / limit), u) if u > 0.0 else 0.0
    if wire[FIRST] > 0.5:
        state[0] = level
    if level >= state[0]:
        state[0] += (level - state[0]) * (1.0 - math.exp(-dt / parameters[2]))
    else:
        excess = state[0] - level
        path = abs(wire[VELOCITY]) * dt / parameters[3] + dt / parameters[4]
        state[0] -= excess * (1.0 - math.exp(-path * (excess / limit) ** parameters[5]))
    kept = state[0]
    if kept <= 0.0:
        return
    positive = max(u, 0.0)
    larger = max(positive, kept)
    wire[CURRENT] = larger * (1.0 + (min(positive, kept) / larger) ** corner) ** (1.0 / corner)


@njit(STEP_SIGNATURE, cache=True)
def two_memories_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gain, length [m], time [s], share of the memory that fades with time. State: the two memories.

    Slip breaks the chains of particles, and the magnetisation of the core fades with time.
    """
    u = wire[CURRENT]
    if wire[FIRST] > 0.5:
        state[0] = u
        state[1] = u
    state[0] = max(u, u + (state[0] - u) * math.exp(-abs(wire[VELOCITY]) * dt / parameters[1]))
    state[1] = max(u, u + (state[1] - u) * math.exp(-dt / parameters[2]))
    share = parameters[3]
    wire[CURRENT] = u + parameters[0] * ((1.0 - share) * (state[0] - u) + share * (state[1] - u))


def _step(gain: float, size: float, kind: float) -> list[Step]:
    return [Step("remanence", Phase.CURRENT_EFFECT, remanence_step, np.array([gain, size, kind]), 2)]


def _together(kind: float) -> Callable[[Values], list[Step]]:
    def steps(values: Values) -> list[Step]:
        numbers = np.array([values["gain"], values["slip_length"], kind, values["relaxation_time"]])
        return [Step("remanence", Phase.CURRENT_EFFECT, remanence_step, numbers, 2)]

    return steps


def _field(kind: float, name: str) -> Callable[[Values], list[Step]]:
    def steps(values: Values) -> list[Step]:
        reference = values.get("reference_drive", 1.0)
        numbers = np.array(
            [values["gain"], values["slip_length"], values["relaxation_time"], values[name], reference, kind]
        )
        return [Step("remanence", Phase.CURRENT_EFFECT, remanent_field_step, numbers, 3)]

    return steps


def _slip(values: Values) -> list[Step]:
    return _step(values["gain"], values["slip_length"], 0.0)


def _time(values: Values) -> list[Step]:
    return _step(values["gain"], values["relaxation_time"], 1.0)


def _past(values: Values) -> list[Step]:
    return _step(values["gain"], 1.0, 2.0)


def _play(values: Values) -> list[Step]:
    return _step(values["gain"], values["width"], 3.0)


def _charging(values: Values) -> list[Step]:
    names = (
        "gain", "limit", "charging_time", "slip_length", "relaxation_time", "fading_power", "corner",
    )  # fmt: skip
    numbers = np.array([values[name] for name in names])
    return [Step("remanence", Phase.CURRENT_EFFECT, charging_field_step, numbers, 1)]


def _two_memories(values: Values) -> list[Step]:
    numbers = np.array([values[name] for name in ("gain", "slip_length", "relaxation_time", "time_share")])
    return [Step("remanence", Phase.CURRENT_EFFECT, two_memories_step, numbers, 2)]


def _plays(values: Values) -> list[Step]:
    numbers = np.array([values["gain"], values["width"], values["exponent"]])
    return [Step("remanence", Phase.CURRENT_EFFECT, many_plays_step, numbers, _PLAYS)]


def _loop(values: Values) -> list[Step]:
    return _step(values["gain"], values["width"], 4.0)


_GAIN = strength("gain", "1", "share of the excess of the past drive that remains", "one", 0.0, 1.0, 0.03)

_HELD = strength("gain", "1", "share of the past drive that remains", "one", 0.0, 1.0, 0.3)
"""Starts of the gain for forms that act only if the memory exceeds the drive: a small gain would have no effect."""

_PLAY_GAIN = strength("gain", "1", "height of the loop over its width", "one", 0.0, 1.5, 0.03)
"""Gain of a play. A gain of 1 is a flux that follows the drive with a coercive width, so no bound lies at 1.
"""

_LENGTH = shape("slip_length", "m", "path over which it fades", "stroke", 0.05, 100.0, (2.0, 8.0))
_TIME = shape("relaxation_time", "s", "time over which it fades", "time", 0.008, 12.0, (0.06, 0.3))

EFFECT = Effect(
    name="remanence",
    summary="the force stays higher after a larger current",
    physics="Iron core and particle chains keep a part of their magnetisation, which motion or time reduces.",
    remedy="Demagnetise with a decaying alternating current, or declare the effect; measure current steps up and down.",
    residual="Positive while the drive falls or after it has been larger; it fades with motion or time. There is none "
    "while the drive only rises from zero.",
    source="An and Kwon 2003 on hysteresis of MR actuators; thesis P2 residual force 22 to 30 N",
    acts_on="effective drive",
    forms=(
        EffectForm(
            "relaxing-with-slip",
            "u + g (m - u), m decays to u over the slip L",
            (_GAIN, shape("slip_length", "m", "path over which it fades", "stroke", 0.05, 60.0, (0.5, 3.0, 12.0))),
            _slip,
        ),
        EffectForm(
            "relaxing-with-time",
            "u + g (m - u), m decays to u over the time tau",
            (_GAIN, shape("relaxation_time", "s", "time over which it fades", "time", 0.008, 6.0, (0.05, 0.2, 1.0))),
            _time,
        ),
        EffectForm("relaxing", "u + g (m - u), m decays to u over L and tau", (_GAIN, _LENGTH, _TIME), _together(5.0)),
        EffectForm("fading", "max(u, g m), m decays to 0 over L and tau", (_HELD, _LENGTH, _TIME), _together(6.0)),
        EffectForm("fading-field", "u + g (m - u) m/(m + u), m decays to 0", (_GAIN, _LENGTH, _TIME), _together(7.0)),
        EffectForm(
            "fading-rounded",
            "(u^p + (g m)^p)^(1/p), dm = -m^2/u_0 (|dx|/L + dt/tau)",
            (
                _HELD,
                _LENGTH,
                _TIME,
                shape("exponent", "1", "sharpness of the corner", "one", 2.0, 20.0, (7.0,)),
                shape("reference_drive", "drive", "drive that L and tau belong to", "drive", 0.999, 1.001, (1.0,)),
            ),
            _field(0.0, "exponent"),
        ),
        EffectForm(
            "fading-limited",
            "max(u, s tanh(g m/s)), m = peak/(1 + slip/L + t/tau)",
            (_HELD, _LENGTH, _TIME, shape("limit", "drive", "largest remanence", "drive", 0.005, 1.0, (0.2,))),
            _field(1.0, "limit"),
        ),
        EffectForm(
            "fading-beside",
            "u + g m exp(-u/w), m decays to 0 over L and tau",
            (
                _GAIN,
                _LENGTH,
                _TIME,
                shape("width", "drive", "drive above which it is small", "drive", 0.01, 2.0, (0.08,)),
            ),
            _field(2.0, "width"),
        ),
        EffectForm(
            "lagging",
            "u + g (m - u)/(1 + (u/w)^2) where m > u, m follows u over L and tau",
            (
                _HELD,
                _LENGTH,
                _TIME,
                shape("width", "drive", "drive above which it is small", "drive", 0.01, 20.0, (0.1, 0.5)),
            ),
            _field(3.0, "width"),
        ),
        EffectForm("fading-root", "sqrt(u^2 + (g m)^2), m decays to 0", (_GAIN, _LENGTH, _TIME), _together(9.0)),
        EffectForm("past-maximum", "u + g (max u - u)", (_GAIN,), _past),
        EffectForm(
            "play",
            "u + g (play_w(u) - u)",
            (_PLAY_GAIN, shape("width", "drive", "width of the loop", "drive", 0.01, 0.9, (0.1, 0.4))),
            _play,
        ),
        EffectForm(
            "loop",
            "u - g w m, dm = (sign du - m) |du|/w",
            (
                strength("gain", "1", "size of the loop over its width", "one", 0.0, 1.0, 0.03),
                shape(
                    "width", "drive", "change of the drive that reverses the memory", "drive", 0.01, 1.5, (0.08, 0.3)
                ),
            ),
            _loop,
        ),
    ),
    needs=("varying-drive",),
    separated_by={
        "delay": Separation("current steps up and down at constant velocity", ("steps",)),
        "saturation": Separation("current steps up and down", ("steps",)),
    },
    refinements=(
        EffectForm(
            "many-plays",
            "u + g sum of w_k (play_k(u) - u), w_k = (width_k/width)^n: domains with different switching thresholds",
            (
                replace(_PLAY_GAIN, starts=(0.6,)),
                shape("width", "drive", "width of the largest play", "drive", 0.01, 1.5, (0.3, 0.6)),
                Parameter("exponent", "1", "weighting of narrow and wide plays", "one", -2.0, 6.0, (0.0,)),
            ),
            _plays,
        ),
        EffectForm(
            "two-memories",
            "u + g ((1 - s)(m - u) + s (n - u)), m decays to u over the slip L, n over the time tau",
            (
                _GAIN,
                shape("slip_length", "m", "path that breaks the chains", "stroke", 0.05, 100.0, (1.0, 4.0)),
                shape("relaxation_time", "s", "time in which the core's part fades", "time", 0.008, 12.0, (0.1, 0.5)),
                Parameter("time_share", "1", "share of the memory that fades with time", "one", 0.0, 1.0, (0.5,)),
            ),
            _two_memories,
        ),
        EffectForm(
            "fading-corner",
            "(u^p + (g m)^p)^(1/p), m decays to 0 over L and tau",
            (_HELD, _LENGTH, _TIME, shape("exponent", "1", "sharpness of the corner", "one", 1.0, 30.0, (3.0, 8.0))),
            _field(4.0, "exponent"),
        ),
        EffectForm(
            "charging",
            "(u^p + k^p)^(1/p); k follows g u/(1 + u/s) with a lag and fades over L and tau, as (k/s)^m",
            (
                replace(_HELD, upper=2.0),
                shape("limit", "drive", "drive at which half of the limit is reached", "drive", 0.1, 20.0, (1.0,)),
                shape("charging_time", "s", "lag with which the field builds up", "time", 2e-4, 0.05, (0.003,)),
                _LENGTH,
                _TIME,
                Parameter("fading_power", "1", "0: constant rate; above 0: faster at first", "one", 0.0, 2.0, (0.5,)),
                shape("corner", "1", "sharpness of the corner", "one", 2.0, 20.0, (7.0,)),
            ),
            _charging,
        ),
    ),
)
