"""The integration of a rig over one test: effects, base form and drive law, sample by sample on a fine clock."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.rigs.bases import STATES, base_step
from benchmarks.rigs.compiling import compiled
from benchmarks.rigs.effects import (
    BACKLASH,
    FRACTIONAL_RATES,
    MEMORY,
    damper_speed,
    effective_drive,
    parallel_force,
    yield_factors,
)
from benchmarks.rigs.types import Array

LINEAR, SATURATING, POLYNOMIAL = range(3)
"""Drive laws of the yield force."""


@compiled
def yield_force(law: Array, u: float) -> float:
    """Return the yield force [N]; law: kind, force at no drive, rise to full drive, full drive, shape."""
    r = max(u, 0.0) / law[3]
    kind = int(law[0])
    if kind == SATURATING:
        r = math.tanh(r / law[4]) / math.tanh(1.0 / law[4])
    elif kind == POLYNOMIAL:
        r = r * (1.0 + law[4] * r) / (1.0 + law[4])
    return law[1] + law[2] * r


@compiled
def viscosity(law: Array, u: float) -> float:
    """Return the viscosity [N s/m]; law: viscosity at no drive, rise to full drive, full drive."""
    return law[0] + law[1] * max(u, 0.0) / law[2]


@compiled
def integrate(
    code: int, p: Array, yield_law: Array, viscous_law: Array, codes: Array, values: Array, still_speed: float,
    x: Array, v: Array, a: Array, u: Array, h: float,
) -> Array:  # fmt: skip
    """Return the force at the rod [N], shape (n,).

    Parameters
    ----------
    code, p, yield_law, viscous_law
        Base form, its numbers, its drive laws.
    codes, values
        Effects that act within the integration, shapes (k,) and (k, 6).
    still_speed
        Speed below which a change of direction is not counted as a reversal [m/s].
    x, v, a, u
        Motion of the rod and lagged drive, shape (n,).
    h
        Step [s].
    """
    size = x.shape[0]
    force = np.zeros(size)
    state, work = np.zeros(STATES), np.zeros((5, STATES))
    memory = np.zeros((max(codes.shape[0], 1), MEMORY))
    drive_memory, play_memory, parallel_memory = memory.copy(), memory.copy(), memory.copy()
    start, stop, factors, yielding = np.zeros(2), np.zeros(2), np.ones(2), np.zeros(2)
    start[0] = stop[0] = x[0]
    state[1] = x[0]
    slip, since, direction, power = 0.0, 0.0, 0.0, 0.0
    play = False
    for k in range(codes.shape[0]):
        play = play or (codes[k] == BACKLASH and values[k, 0] > 0.0)
    for j in range(size):
        stop[1] = damper_speed(codes, values, play_memory, v[j], h)
        stop[0] = start[0] + 0.5 * h * (start[1] + stop[1]) if play else x[j]
        if abs(stop[1]) > still_speed and stop[1] * direction <= 0.0:
            direction = 1.0 if stop[1] > 0.0 else -1.0
            slip, since = 0.0, 0.0
        slip += abs(stop[1]) * h
        since += h
        seen = effective_drive(codes, values, drive_memory, u[j], stop[1], h)
        yield_factors(codes, values, memory, stop[0], stop[1], slip, since, power, j * h, h, factors)
        yielding[1] = yield_force(yield_law, seen)
        yielding[0] = factors[0] * yielding[1]
        c = factors[1] * viscosity(viscous_law, seen)
        core = base_step(code, p, state, start, stop, a[j], yielding, c, h, work)
        power = core * stop[1]
        force[j] = parallel_force(
            codes, values, parallel_memory, FRACTIONAL_RATES, core, x[j], v[j], a[j], seen, j * h, h
        )
        start[0], start[1] = stop[0], stop[1]
    return force
