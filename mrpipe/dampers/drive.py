"""From the command to the coefficients: the lag of the drive (2.4) and the laws of the drive (2.3)."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.laws import LAW_SIZE, Law
from mrpipe.dampers.plant import (
    CURRENT,
    DRIVE,
    FIRST,
    PART_FORCE,
    STEP_SIGNATURE,
    VISCOSITY,
    YIELD_FORCE,
    Chain,
    Phase,
    Step,
)

POLYNOMIAL_SIZE = 4
"""Number of coefficients of each polynomial in the effective drive; (2.3) is a cubic polynomial."""

COEFFICIENT_STEPS = ("polynomial-coefficients", "drive-laws")
"""Names of the steps that set yield force and viscosity from the effective drive."""


@njit(float64(float64, float64, float64, float64), cache=True)
def advance_lag(lagged: float, previous: float, present: float, rate_dt: float) -> float:
    """Return the exact response of u' = -eta (u - I) to a command that is linear from `previous` to `present`.

    `rate_dt` is eta times the interval. For recorded commands linear interpolation between samples is accurate to
    second order; a held command would be half a sample late.
    """
    if rate_dt < 1e-8:
        return lagged
    decay = math.exp(-rate_dt)
    slope = (present - previous) / rate_dt
    return present - slope + (lagged - previous + slope) * decay


@njit(STEP_SIGNATURE, cache=True)
def lag_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: eta [1/s]. State: effective drive, last command. It starts in equilibrium with the command."""
    if wire[FIRST] > 0.5:
        state[0] = wire[DRIVE]
    else:
        state[0] = advance_lag(state[0], state[1], wire[DRIVE], parameters[0] * dt)
    state[1] = wire[DRIVE]
    wire[CURRENT] = state[0]


@njit(STEP_SIGNATURE, cache=True)
def lag_apart_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: eta of a rising and of a falling effective drive [1/s]. State: effective drive, last command."""
    if wire[FIRST] > 0.5:
        state[0] = wire[DRIVE]
    else:
        # the mean command over the interval determines the rate
        rate = parameters[0] if abs(wire[DRIVE]) + abs(state[1]) > 2.0 * abs(state[0]) else parameters[1]
        state[0] = advance_lag(state[0], state[1], wire[DRIVE], rate * dt)
    state[1] = wire[DRIVE]
    wire[CURRENT] = state[0]


@njit(STEP_SIGNATURE, cache=True)
def polynomial_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: four coefficients of the yield force [N, N/A, ...], four of the viscosity [N s/m, ...]."""
    u = wire[CURRENT]
    wire[YIELD_FORCE] = parameters[0] + u * (parameters[1] + u * (parameters[2] + u * parameters[3]))
    wire[VISCOSITY] = parameters[4] + u * (parameters[5] + u * (parameters[6] + u * parameters[7]))


@njit(float64(float64[::1], float64), cache=True)
def law_value(law: FloatArray, drive: float) -> float:
    """Return the value of a packed :class:`~mrpipe.dampers.laws.Law` at a drive, at least 0."""
    if law[0] == 0.0:
        value = law[1] + drive * (law[2] + drive * (law[3] + drive * (law[4] + drive * (law[5] + drive * law[6]))))
        return max(value, 0.0)
    ratio = drive / law[3]
    if law[0] == 1.0:
        share = math.tanh(ratio)
    elif law[0] == 3.0:
        share = ratio / (1.0 + abs(ratio))
    elif abs(ratio) < 1e-2:
        share = ratio / 3.0 - ratio**3 / 45.0
    else:
        share = 1.0 / math.tanh(ratio) - 1.0 / ratio
    return max(law[1] + law[2] * share, 0.0)


@njit(STEP_SIGNATURE, cache=True)
def laws_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: packed laws of yield force [N], viscosity [N s/m] and second part's force [N]."""
    wire[YIELD_FORCE] = law_value(parameters[0:7], wire[CURRENT])
    wire[VISCOSITY] = law_value(parameters[7:14], wire[CURRENT])
    wire[PART_FORCE] = law_value(parameters[14:21], wire[CURRENT])


def driver_lag(eta: float) -> Step:
    """Return the lag of the drive (2.4), with eta in 1/s."""
    return Step("driver-lag", Phase.CURRENT, lag_step, np.array([float(eta)]), state_size=2)


def command_place(chain: Chain) -> int:
    """Return the index in the state of a chain of the last command; -1 if the chain has no lag (2.4).

    The lag interpolates the command linearly between the ends of a step. If the command jumps at the beginning of a
    step and is held over it, like that of a sampled controller, write the present command to this place.
    """
    for function, at in zip(chain.functions, chain.state_offsets, strict=False):
        if function is lag_step or function is lag_apart_step:
            return int(at) + 1
    return -1


def driver_lag_apart(rise: float, fall: float) -> Step:
    """Return the lag of the drive with separate rates [1/s] for rising and falling effective drive."""
    return Step("driver-lag", Phase.CURRENT, lag_apart_step, np.array([float(rise), float(fall)]), state_size=2)


def polynomial_coefficients(yield_force: Sequence[float] | FloatArray, viscosity: Sequence[float] | FloatArray) -> Step:
    """Return (2.3): yield force and viscosity as polynomials of the effective drive, constant first."""
    numbers = np.zeros(2 * POLYNOMIAL_SIZE)
    numbers[: len(yield_force)] = yield_force
    numbers[POLYNOMIAL_SIZE : POLYNOMIAL_SIZE + len(viscosity)] = viscosity
    return Step("polynomial-coefficients", Phase.COEFFICIENTS, polynomial_step, numbers)


def coefficients(yield_force: Law, viscosity: Law, part: Law | None = None) -> Step:
    """Return the step that sets yield force, viscosity and the force of a second part from the effective drive."""
    both = (yield_force, viscosity)
    if part is None and all(law.kind == "polynomial" and len(law.numbers) <= POLYNOMIAL_SIZE for law in both):
        return polynomial_coefficients(yield_force.numbers, viscosity.numbers)
    last = np.zeros(LAW_SIZE) if part is None else part.packed
    return Step("drive-laws", Phase.COEFFICIENTS, laws_step, np.concatenate([*(law.packed for law in both), last]))
