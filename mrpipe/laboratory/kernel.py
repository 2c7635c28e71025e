"""True damper of the virtual rig: the ordinary differential equations (2.1) to (2.4) in fine time steps.

One compiled step integrates the rod's play, the current, the coefficients, the hysteretic variable (Runge-Kutta of
order four) and the parallel forces, with any number of planted effects; :mod:`mrpipe.laboratory.effects` names them.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.laboratory.coefficient_effects import RATE_CREEP, coefficient_factors, parallel_force
from mrpipe.laboratory.current_effects import effective_current

# state of the damper
Z, U, ROD, CONTACT, DIRECTION, SLIP, SINCE, KNOCK, STARTED, POWER, ROD_SPEED = range(11)
STATE_SIZE = 12
EFFECT_STATE = 8
RING = 1024
PARAMETERS = 8
BASE = ("alpha_a", "alpha_b", "alpha_c", "alpha_d", "c0_a", "c0_b", "A", "gamma", "beta", "n", "eta")

BACKLASH_FREE, BACKLASH_HELD = 50, 51


@njit(cache=True, inline="always")
def _rate(z: float, v: float, base: FloatArray, creep: float) -> float:
    """Return z' of (2.2) minus the creep rate of the particle chains under load (a planted effect; 0 without it)."""
    size = abs(z)
    power = size if base[9] == 2.0 else size ** (base[9] - 1.0)
    return base[6] * v - base[7] * abs(v) * z * power - base[8] * v * size * power - creep * z * size * size


@njit(cache=True)
def _hysteresis(z: float, v0: float, v1: float, h: float, base: FloatArray, creep: float) -> float:
    """Return z after one step of order four; the velocity is linear within the step."""
    middle = 0.5 * (v0 + v1)
    k1 = _rate(z, v0, base, creep)
    k2 = _rate(z + 0.5 * h * k1, middle, base, creep)
    k3 = _rate(z + 0.5 * h * k2, middle, base, creep)
    k4 = _rate(z + h * k3, v1, base, creep)
    return z + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@njit(cache=True)
def _rod_held(state: FloatArray, parameters: FloatArray, x1: float, v1: float, h: float) -> float:
    """Return the speed of the rod inside the play with friction; it approaches that of the flank near contact."""
    half = 0.5 * parameters[0]
    if half <= 0.0:
        return v1
    place = (x1 - state[ROD]) / half
    outward = place * (1.0 if v1 > 0.0 else -1.0)
    share = 0.0
    if outward > 0.0:
        share = min(outward, 1.0) ** parameters[1]
    before = state[CONTACT]
    state[CONTACT] = (1.0 if v1 > 0.0 else -1.0) if share > 0.5 else 0.0
    if before == 0.0 and state[CONTACT] != 0.0:
        state[KNOCK] = state[CONTACT] * abs(v1)
    # the rod never leaves the play
    target = state[ROD] + share * v1 * h
    target = min(max(target, x1 - half), x1 + half)
    speed = (target - state[ROD]) / h
    state[ROD] = target
    return speed


@njit(cache=True)
def _begin(state: FloatArray, ring: FloatArray, drive: float, x1: float, count: int) -> None:
    """Start current and rod in equilibrium at the first step."""
    if state[STARTED] < 0.5:
        state[STARTED] = 1.0
        state[U] = drive
        state[ROD] = x1
        for k in range(count):
            ring[k, :] = drive


@njit(cache=True)
def _note_reversal(state: FloatArray, speed: float, h: float) -> None:
    """Update path and time since the last reversal of the rod."""
    if speed * state[DIRECTION] < 0.0:
        state[SLIP] = 0.0
        state[SINCE] = 0.0
    if speed != 0.0:
        state[DIRECTION] = 1.0 if speed > 0.0 else -1.0
    state[SLIP] += abs(speed) * h
    state[SINCE] += h


@njit(cache=True)
def _in_play(state: FloatArray, core: float) -> float:
    """Return the force of a rod that is free inside its play: the flank can only push."""
    if state[CONTACT] == 0.0:
        return 0.0
    if core * state[CONTACT] < 0.0:
        # the contact opens, and the force of the rod is zero
        state[CONTACT] = 0.0
        return 0.0
    return core


@njit(cache=True)
def damper_step(
    base: FloatArray,
    codes: IntArray,
    values: FloatArray,
    state: FloatArray,
    memory: FloatArray,
    ring: FloatArray,
    x1: float,
    v0: float,
    v1: float,
    a1: float,
    drive: float,
    time: float,
    h: float,
) -> float:
    """Advance the damper by `h` and return its force [N] at the end of the step.

    Parameters
    ----------
    base
        Shape (11,), the numbers of :data:`BASE`, SI.
    codes, values
        Planted effects, shape (k,), and their numbers, shape (k, 8).
    state, memory, ring
        State of the damper, of the effects, and of their delay lines, shapes (12,), (k, 8), (k, 1024); zeros at the
        start.
    x1, v0, v1, a1
        Motion of the actuator at the end (v0: start) of the step [m], [m/s], [m/s2].
    drive
        Coil current commanded to the driver at the end of the step [A].
    time
        Time in the test at the end of the step [s].
    h
        Time step [s].
    """
    count = codes.shape[0]
    _begin(state, ring, drive, x1, count)
    asked = effective_current(codes, values, memory, ring, drive, v1, h, 0)
    state[U] = asked + (state[U] - asked) * math.exp(-base[10] * h)
    u = max(effective_current(codes, values, memory, ring, state[U], v1, h, 1), 0.0)
    alpha = base[0] + u * (base[1] + u * (base[2] + u * base[3]))
    c0 = base[4] + base[5] * u

    speed0, speed1 = v0, v1
    rod = x1
    free = -1
    creep = 0.0
    for k in range(count):
        if codes[k] == BACKLASH_HELD:
            speed0 = state[ROD_SPEED]
            speed1 = _rod_held(state, values[k], x1, v1, h)
            rod = state[ROD]
        elif codes[k] == BACKLASH_FREE:
            free = k
        elif codes[k] == RATE_CREEP:
            # the speed at which creep of the fully stretched chains equals the motion
            creep = values[k, 0] * base[6] * ((base[7] + base[8]) / base[6]) ** (3.0 / base[9])
    if free >= 0:
        speed1 = _rod_free(state, values[free, 0], x1, v1, alpha, c0, base, h)
        speed0 = state[ROD_SPEED]
        rod = state[ROD]
    state[ROD_SPEED] = speed1
    _note_reversal(state, speed1, h)

    if free < 0 or state[CONTACT] != 0.0:
        state[Z] = _hysteresis(state[Z], speed0, speed1, h, base, creep)
    yielding, viscous = coefficient_factors(codes, values, memory, state, rod, speed1, h)
    core = alpha * yielding * state[Z] + c0 * viscous * speed1
    if free >= 0:
        core = _in_play(state, core)
    state[POWER] = abs(core * speed1)
    return parallel_force(codes, values, memory, core, rod, speed1, a1, u, drive, time, h)


@njit(cache=True)
def _rod_free(
    state: FloatArray, gap: float, x1: float, v1: float, alpha: float, c0: float, base: FloatArray, h: float
) -> float:
    """Return the speed of the rod where it is free inside the play, so that its force is zero until contact."""
    half = 0.5 * gap
    if state[CONTACT] != 0.0:
        rod = x1 - state[CONTACT] * half
        speed = v1
        state[ROD] = rod
        return speed
    stiffness = max(alpha, 1e-9) * base[6]
    z = state[Z] * math.exp(-stiffness / max(c0, 1e-9) * h)
    rod = state[ROD] + (z - state[Z]) / base[6]
    distance = x1 - rod
    if abs(distance) >= half:
        state[CONTACT] = 1.0 if distance > 0.0 else -1.0
        speed = (rod - state[ROD]) / h
        state[KNOCK] = v1 - speed
        rod = x1 - state[CONTACT] * half
        speed = (rod - state[ROD]) / h
        state[ROD] = rod
        return speed
    speed = (rod - state[ROD]) / h
    state[ROD] = rod
    state[Z] = z
    return speed


@njit(cache=True, nogil=True)
def run_damper(
    base: FloatArray,
    codes: IntArray,
    values: FloatArray,
    x: FloatArray,
    v: FloatArray,
    a: FloatArray,
    drive: FloatArray,
    h: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Run the damper over a prescribed motion on the fine clock.

    Returns
    -------
    Force [N], closing speed of the play at contact [m/s] (otherwise 0) and rod position [m], each of shape (n,).
    """
    n = x.shape[0]
    force = np.zeros(n)
    knock = np.zeros(n)
    rod = np.zeros(n)
    state = np.zeros(STATE_SIZE)
    memory = np.zeros((max(codes.shape[0], 1), EFFECT_STATE))
    ring = np.zeros((max(codes.shape[0], 1), RING))
    for i in range(n):
        before = v[i - 1] if i > 0 else v[0]
        force[i] = damper_step(base, codes, values, state, memory, ring, x[i], before, v[i], a[i], drive[i], i * h, h)
        knock[i] = state[KNOCK]
        state[KNOCK] = 0.0
        rod[i] = state[ROD]
    return force, knock, rod
