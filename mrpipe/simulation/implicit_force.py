"""Parts of the search for the force at the end of a step, which both compiled loops share.

The force of a damper depends on the motion at the end of the step, and this motion depends on the force. A guess of
the force is inserted until the damper answers with the guess: by a secant within a bracket, and by bisection where a
law jumps. The bracket is a change of sign of answer minus guess. It is valid because the answer grows less than the
guess (a force slows the motion that causes it).
"""

from __future__ import annotations

import math
from typing import Any

from numba import float64, int64, njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.dampers.plant import (
    ACCELERATION,
    CHAIN_FUNCTIONS,
    DISPLACEMENT,
    DRIVE,
    FORCE,
    TIME,
    VELOCITY,
    advance,
)

ITERATIONS = 60
PLAIN_ITERATIONS = 12
"""Iterations after which the bracket is halved, because a law that jumps has no slope."""
TOLERANCE_N, TOLERANCE = 1e-5, 1e-7
"""Difference of answer and guess at which the search ends [N], and as a share of the answer."""
CORRECTED_N, CORRECTED = 2e-3, 1e-4
"""Difference after which one correction with the slope leaves a negligible error [N], and as a share of the answer."""
LARGEST_SLOPE = 0.9


@njit(
    float64(
        CHAIN_FUNCTIONS, float64[::1], int64[::1], int64[::1], float64[::1], float64[::1], float64[::1],
        float64, float64, float64, float64, float64, float64,
    ),
    cache=True,
)  # fmt: skip
def damper_force(
    functions: Any, parameters: FloatArray, parameter_offsets: IntArray, state_offsets: IntArray, before: FloatArray,
    state: FloatArray, wire: FloatArray, time: float, x: float, v: float, a: float, drive: float, dt: float,
) -> float:  # fmt: skip
    """Advance a copy of the damper's state `before` over one step; return the force at its end [N].

    `state` becomes the state at the end. Time, motion and drive are those at the end of the step, in SI.
    """
    for index in range(before.shape[0]):
        state[index] = before[index]
    wire[TIME] = time
    wire[DISPLACEMENT] = x
    wire[VELOCITY] = v
    wire[ACCELERATION] = a
    wire[DRIVE] = drive
    advance(functions, parameters, parameter_offsets, state_offsets, state, wire, dt)
    return wire[FORCE]


@njit(inline="always")
def settled(found: float, guess: float) -> bool:
    """Return whether the damper answers a guess of its force with the guess."""
    return abs(found - guess) <= TOLERANCE_N + TOLERANCE * abs(found)


@njit(inline="always")
def nearly_settled(found: float, guess: float) -> bool:
    """Return whether answer and guess are so close that :func:`secant` leaves a negligible error."""
    return abs(found - guess) <= CORRECTED_N + CORRECTED * abs(found)


@njit(inline="always")
def secant(found: float, guess: float, slope: float) -> float:
    """Return the force at which answer and guess are equal, if the answer changes by `slope` with the guess."""
    return guess + (found - guess) / (1.0 - slope)


@njit(inline="always")
def slope_between(found: float, guess: float, last_found: float, last_guess: float) -> float:
    """Return the change of the answer with the guess [1]; it is limited, because at 1 there is no solution."""
    return min((found - last_found) / (guess - last_guess), LARGEST_SLOPE)


@njit(inline="always")
def narrowed(low: float, high: float, found: float, guess: float) -> tuple[float, float]:
    """Return the bracket of the solution after the answer to one more guess."""
    return (max(low, guess), high) if found > guess else (low, min(high, guess))


@njit(inline="always")
def next_guess(iteration: int, found: float, guess: float, slope: float, low: float, high: float) -> float:
    """Return the next guess: that of the secant, or the middle of the bracket; the old one if there is none between."""
    following = secant(found, guess, slope)
    inside = low < following < high
    if low > -math.inf and high < math.inf:
        return following if inside and iteration < PLAIN_ITERATIONS else 0.5 * (low + high)
    return following if inside else found
