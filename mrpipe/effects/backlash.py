"""Backlash: play in the bearings of the rod."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Separation, Values, shape, strength


@njit(STEP_SIGNATURE, cache=True)
def play_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gap [m] between the flanks, stiffness share within the gap, kind. State: damper positions.

    Kinds: 0 the damper rests within the gap; 1 several plays of increasing gap (a worn bearing); 2 the damper follows
    with a share of the motion within the gap.
    """
    x = wire[DISPLACEMENT]
    gap, share, kind = parameters[0], parameters[1], parameters[2]
    count = 3 if kind == 1.0 else 1
    moved = 0.0
    for index in range(count):
        width = gap * (1.0 if count == 1 else (0.5 + 0.5 * index))
        if wire[FIRST] > 0.5:
            state[index] = x
        before = state[index]
        state[index] = min(max(before, x - 0.5 * width), x + 0.5 * width)
        moved += (state[index] - before) / count
    if wire[FIRST] > 0.5:
        state[3] = x
        state[4] = x
        return
    rod = x - state[4]
    if kind == 2.0:
        moved = moved + share * (rod - moved)
    state[4] = x
    state[3] += moved
    wire[DISPLACEMENT] = state[3]
    # share of the speed of the rod with which the damper moves: without a gap the velocity is unchanged
    if rod != 0.0:
        wire[VELOCITY] *= min(max(moved / rod, 0.0), 1.0)


_PLAYS = 8


@njit(STEP_SIGNATURE, cache=True)
def graded_play_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: mean gap [m], spread of the gaps (0..1). State: plays, damper, rod.

    A Prandtl-Ishlinskii operator: the mean of plays with evenly spaced gaps from g (1 - s) to g (1 + s), as with soft
    or uneven flanks, which engage gradually.
    """
    x = wire[DISPLACEMENT]
    gap, spread = parameters[0], parameters[1]
    if wire[FIRST] > 0.5:
        for index in range(_PLAYS + 2):
            state[index] = x
        return
    moved = 0.0
    for index in range(_PLAYS):
        half = 0.5 * gap * (1.0 + spread * ((2.0 * index + 1.0) / _PLAYS - 1.0))
        before = state[index]
        state[index] = min(max(before, x - half), x + half)
        moved += (state[index] - before) / _PLAYS
    rod = x - state[_PLAYS + 1]
    state[_PLAYS + 1] = x
    state[_PLAYS] += moved
    wire[DISPLACEMENT] = state[_PLAYS]
    if rod != 0.0:
        wire[VELOCITY] *= min(max(moved / rod, 0.0), 1.0)


@njit(STEP_SIGNATURE, cache=True)
def lost_motion_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gap [m], transition velocity [m/s]. State: last smoothed sign.

    The damper lags the rod by half the gap in the direction of motion; the change of side is rounded over the speed.
    """
    v = wire[VELOCITY]
    sign = v / (abs(v) + parameters[1])
    if wire[FIRST] > 0.5:
        state[0] = sign
    change = (sign - state[0]) / dt
    state[0] = sign
    wire[DISPLACEMENT] -= 0.5 * parameters[0] * sign
    moved = v - 0.5 * parameters[0] * change
    wire[VELOCITY] = max(moved, 0.0) if v > 0.0 else min(moved, 0.0)


@njit(STEP_SIGNATURE, cache=True)
def free_play_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gap [m]. State: position in the gap, damper position, rod position, last force, last damper position.

    A joint without friction: the flank stays in contact while the force presses on it, so the gap is crossed when the
    force passes zero. The instant between two samples follows from the slope of the force over the last step.
    """
    x = wire[DISPLACEMENT]
    half = 0.5 * parameters[0]
    force = wire[FORCE]
    if wire[FIRST] > 0.5:
        state[0] = 0.0
        state[1] = x
        state[2] = x
        state[3] = 0.0
        state[4] = x
        return
    rod = x - state[2]
    left = rod
    moved = 0.0
    place = state[0]
    # distance that the damper can still move while its force presses on this flank
    if abs(place) >= half and force * place > 0.0 and rod * force < 0.0:
        change = state[1] - state[4]
        slope = (force - state[3]) / change if abs(change) > 1e-12 else 0.0
        reach = abs(rod) if slope <= 0.0 else abs(force) / slope
        carried = min(abs(rod), reach) * (1.0 if rod > 0.0 else -1.0)
        moved += carried
        left -= carried
    if left != 0.0:
        free = min(max(place + left, -half), half) - place
        place += free
        moved += left - free
    state[4] = state[1]
    state[3] = force
    state[1] += moved
    state[2] = x
    state[0] = place
    wire[DISPLACEMENT] = state[1]
    if rod != 0.0:
        wire[VELOCITY] *= min(max(moved / rod, 0.0), 1.0)


def _free(values: Values) -> list[Step]:
    return [Step("free-play", Phase.MOTION, free_play_step, np.array([values["gap"]]), 5)]


def _play(gap: float, share: float, kind: float) -> list[Step]:
    return [Step("play", Phase.MOTION, play_step, np.array([gap, share, kind]), 5)]


def _hard(values: Values) -> list[Step]:
    return _play(values["gap"], 0.0, 0.0)


def _worn(values: Values) -> list[Step]:
    return _play(values["gap"], 0.0, 1.0)


def _carried(values: Values) -> list[Step]:
    return _play(values["gap"], values["carried_share"], 2.0)


def _lost(values: Values) -> list[Step]:
    numbers = np.array([values["gap"], values["transition_velocity"]])
    return [Step("lost-motion", Phase.MOTION, lost_motion_step, numbers, 1)]


def _graded(values: Values) -> list[Step]:
    numbers = np.array([values["gap"], values["spread"]])
    return [Step("graded-play", Phase.MOTION, graded_play_step, numbers, _PLAYS + 2)]


_GAP = strength("gap", "m", "distance between the flanks", "stroke", 0.0, 0.5, 0.004, 0.016, 0.05, 0.15)

EFFECT = Effect(
    name="backlash",
    summary="play between rod and damper: the damper rests while the rod crosses the gap",
    physics="With a worn bearing or clevis the rod moves freely through a gap before it moves the damper.",
    remedy="Fit a new bush or preload the joint; measure small slow triangles at two currents.",
    residual="A spike after each reversal: the measured force stays constant while the force of the model already "
    "changes. The width of the spike in displacement is the gap.",
    source="play operator (Krasnoselskii and Pokrovskii 1989)",
    acts_on="rod motion",
    forms=(
        EffectForm("held", "play of width g", (_GAP,), _hard),
        EffectForm("worn", "mean of three plays of g/2, g, 3g/2", (_GAP,), _worn),
        EffectForm("free", "the gap is crossed where the force passes zero", (_GAP,), _free),
        EffectForm(
            "carried",
            "within the gap the damper follows with a share",
            (
                _GAP,
                shape("carried_share", "1", "share of the motion that the damper follows", "one", 0.02, 0.9, (0.3,)),
            ),
            _carried,
        ),
        EffectForm(
            "lost-motion",
            "x - g/2 v/(|v| + v_t)",
            (
                _GAP,
                shape(
                    "transition_velocity",
                    "m/s",
                    "speed over which the change of side is rounded",
                    "speed",
                    0.001,
                    0.5,
                    (0.03, 0.15),
                ),
            ),
            _lost,
        ),
    ),
    separated_by={"migration": Separation("small slow triangles at two currents", ("reversal",))},
    refinements=(
        EffectForm(
            "graded",
            "mean of plays of gaps from g (1 - s) to g (1 + s)",
            (
                _GAP,
                Parameter(
                    "spread", "1", "0: all gaps equal; 1: gaps from 0 to twice the mean", "one", 0.0, 1.0, (0.5,)
                ),
            ),
            _graded,
        ),
    ),
)
