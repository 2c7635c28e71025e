"""Backlash: play in the bearings of the rod."""

from __future__ import annotations

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.hysteresis import displacement_between, turning_share
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Separation, Values, shape, strength

WINDOW = 0.5
"""Numerical technique: length in steps, centred at the sample, over which the damper takes up the speed of the rod
where the flanks meet. Without it, the force at a sample would jump while the gap changes, and least squares would find
no slope."""

NARROW_WINDOW = 0.125
"""The same for graded plays, whose search begins at the gap that another form has found."""


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def _last_turn(before: float, speed_before: float, x: float, v: float, dt: float) -> float:
    """Return the place from which the rod moves to `x` without a reversal: its turning point, or its last place.

    The arguments are those of :func:`turning_share`. At 250 samples a second a fast motion goes beyond its largest
    sample by several per cent of a gap.
    """
    share = turning_share(before, speed_before, x, v, dt)
    return before if share >= 1.0 else displacement_between(share, before, speed_before, x, v, dt)


@njit(float64(float64, float64, float64), cache=True)
def _engaged(past: float, apart: float, reach: float) -> float:
    """Return the share of the speed of the rod with which the damper moves at a sample, 0 to 1.

    The force belongs to the instant of the sample: the damper has the speed of the rod if the flanks have met before.
    The rise from 0 to 1 is linear, see :data:`WINDOW`.

    Parameters
    ----------
    past
        Distance of the rod beyond the place where the flanks meet [m], negative within the gap.
    apart
        Distance from the last turning point of the rod, or from its last place, to that place [m]. The rise is not
        longer, so that a gap of zero leaves the velocity unchanged.
    reach
        Half of the window [m].
    """
    half = min(reach, apart)
    if half <= 0.0:
        return 1.0 if past >= 0.0 else 0.0
    return min(max(0.5 + 0.5 * past / half, 0.0), 1.0)


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def _engaged_play(play: float, half: float, turn: float, x: float, reach: float) -> float:
    """Return the share of the speed of the rod with which a play moves at a sample, see :func:`_engaged`.

    Parameters
    ----------
    play
        Place of the play at the last turning point of the rod [m].
    half
        Half of its gap [m].
    turn, x
        Displacement of the rod at that point, or at its last place, and at the sample [m].
    reach
        Half of the window, with the sign of the velocity of the rod [m].
    """
    sign = 1.0 if reach > 0.0 else -1.0
    # the flanks meet where the rod is half a gap ahead of the play
    apart = half + sign * (play - turn)
    return _engaged(sign * (x - turn) - apart, apart, abs(reach))


@njit(STEP_SIGNATURE, cache=True)
def play_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gap [m] between the flanks, stiffness share within the gap, kind.

    Kinds: 0 the damper rests within the gap; 1 several plays of increasing gap (a worn bearing); 2 the damper follows
    with a share of the motion within the gap. State: places of the plays [m], damper [m], displacement and velocity of
    the rod.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    gap, share, kind = parameters[0], parameters[1] if parameters[2] == 2.0 else 0.0, parameters[2]
    if wire[FIRST] > 0.5:
        for index in range(5):
            state[index] = x
        state[5] = v
        return
    turn = _last_turn(state[4], state[5], x, v, dt)
    reach = 0.5 * WINDOW * v * dt
    count = 3 if kind == 1.0 else 1
    moved, engaged = 0.0, 0.0
    for index in range(count):
        half = 0.5 * gap * (1.0 if count == 1 else (0.5 + 0.5 * index))
        before = state[index]
        at_turn = min(max(before, turn - half), turn + half)
        state[index] = min(max(at_turn, x - half), x + half)
        moved += (state[index] - before) / count
        engaged += _engaged_play(at_turn, half, turn, x, reach) / count
    state[3] += moved + share * (x - state[4] - moved)
    state[4] = x
    state[5] = v
    wire[DISPLACEMENT] = state[3]
    wire[VELOCITY] *= engaged + share * (1.0 - engaged)


_PLAYS = 8


@njit(STEP_SIGNATURE, cache=True)
def graded_play_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: mean gap [m], spread of the gaps (0..1). State: plays, damper, displacement and velocity of the rod.

    A Prandtl-Ishlinskii operator: the mean of plays with evenly spaced gaps from g (1 - s) to g (1 + s), as with soft
    or uneven flanks, which engage gradually.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    gap, spread = parameters[0], parameters[1]
    if wire[FIRST] > 0.5:
        for index in range(_PLAYS + 2):
            state[index] = x
        state[_PLAYS + 2] = v
        return
    turn = _last_turn(state[_PLAYS + 1], state[_PLAYS + 2], x, v, dt)
    reach = 0.5 * NARROW_WINDOW * v * dt
    moved, engaged = 0.0, 0.0
    for index in range(_PLAYS):
        half = 0.5 * gap * (1.0 + spread * ((2.0 * index + 1.0) / _PLAYS - 1.0))
        before = state[index]
        at_turn = min(max(before, turn - half), turn + half)
        state[index] = min(max(at_turn, x - half), x + half)
        moved += (state[index] - before) / _PLAYS
        engaged += _engaged_play(at_turn, half, turn, x, reach) / _PLAYS
    state[_PLAYS + 1] = x
    state[_PLAYS + 2] = v
    state[_PLAYS] += moved
    wire[DISPLACEMENT] = state[_PLAYS]
    wire[VELOCITY] *= engaged


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


@njit(float64(float64[::1], float64, float64, float64, float64), cache=True)
def _across_free_gap(state: FloatArray, half: float, rod: float, force: float, reach: float) -> float:
    """Move the rod without a reversal, and return the share of its speed that the damper has at the end.

    Parameters
    ----------
    state
        Of :func:`free_play_step`; the place in the gap and the position of the damper are changed.
    half
        Half of the gap [m].
    rod
        Motion of the rod [m].
    force
        Force at the last sample [N].
    reach
        Half of the window of :func:`_engaged` [m].
    """
    left, place = rod, state[0]
    # distance that the damper can still move while its force presses on this flank
    if abs(place) >= half and force * place > 0.0 and rod * force < 0.0:
        change = state[1] - state[4]
        slope = (force - state[3]) / change if abs(change) > 1e-12 else 0.0
        carried_most = abs(rod) if slope <= 0.0 else abs(force) / slope
        carried = min(abs(rod), carried_most) * (1.0 if rod > 0.0 else -1.0)
        state[1] += carried
        left -= carried
        if left == 0.0:
            return 1.0
    free = min(max(place + left, -half), half) - place
    state[0] = place + free
    state[1] += left - free
    apart = half - place if left > 0.0 else half + place
    return _engaged(abs(left) - apart, apart, reach)


@njit(STEP_SIGNATURE, cache=True)
def free_play_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gap [m].

    State: position in the gap, damper position, displacement of the rod, last force, last damper position, velocity of
    the rod. A joint without friction: the flank stays in contact while the force presses on it, so the gap is crossed
    when the force passes zero. The instant between two samples follows from the slope of the force over the last step.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    half = 0.5 * parameters[0]
    force = wire[FORCE]
    if wire[FIRST] > 0.5:
        state[0] = 0.0
        state[1] = x
        state[2] = x
        state[3] = 0.0
        state[4] = x
        state[5] = v
        return
    damper = state[1]
    turn, reach = _last_turn(state[2], state[5], x, v, dt), 0.5 * WINDOW * abs(v) * dt
    if turn != state[2]:
        _across_free_gap(state, half, turn - state[2], force, reach)
    engaged = _across_free_gap(state, half, x - turn, force, reach)
    state[2] = x
    state[3] = force
    state[4] = damper
    state[5] = v
    wire[DISPLACEMENT] = state[1]
    wire[VELOCITY] *= engaged


def _free(values: Values) -> list[Step]:
    return [Step("free-play", Phase.MOTION, free_play_step, np.array([values["gap"]]), 6)]


def _play(gap: float, share: float, kind: float) -> list[Step]:
    return [Step("play", Phase.MOTION, play_step, np.array([gap, share, kind]), 6)]


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
    return [Step("graded-play", Phase.MOTION, graded_play_step, numbers, _PLAYS + 3)]


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
