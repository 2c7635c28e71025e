"""Functions that the laws of friction with negative stiffness share: f = sign(v) alpha X - alpha x (4.18), (4.20)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control import exact, limits
from mrpipe.control.gains import Gains
from mrpipe.control.kernel import GAIN_ALPHA, LAW_SIGNATURE, ROUNDING, S_AMPLITUDE, S_DIRECTION, S_V, S_X
from mrpipe.control.law import Assessment, GainRange, Plant
from mrpipe.control.linearisation import friction_stiffness

FRICTION = GainRange(
    "alpha_n_m",
    "friction with negative stiffness",
    lambda plant: (
        0.05 * min(limits.optimal_friction(plant.modes), plant.static_stiffness_n_m),
        0.98 * plant.static_stiffness_n_m,
    ),
    softens=True,
)


@njit(LAW_SIGNATURE, cache=True)
def friction_force(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Return f = alpha (sign(v) X - x) (4.18), where X is the last extremum of the displacement."""
    # the pending extremum is used if it already exceeds the last one, so that the force dissipates in a growing motion
    amplitude = max(state[S_AMPLITUDE], abs(state[S_X]))
    side = state[S_DIRECTION]
    if numbers[ROUNDING] > 0.0:
        side = math.tanh(state[S_V] / numbers[ROUNDING])
    return numbers[GAIN_ALPHA] * (side * amplitude - state[S_X])


C_BODY = """\
    const double amplitude = larger(state[S_AMPLITUDE], fabs(state[S_X]));
    const double side = numbers[ROUNDING] > 0.0 ? tanh(state[S_V] / numbers[ROUNDING]) : state[S_DIRECTION];
    return numbers[GAIN_ALPHA] * (side * amplitude - state[S_X]);
"""


def friction_candidates(plant: Plant) -> Mapping[str, Gains]:
    """Return alpha by closed form (4.25), P2 (20), and for the largest exact damping of the equivalent.

    The equivalent can have its optimum where the friction would hold the structure at its extremum, or no optimum at
    all. The exact alpha is then the one with which a free vibration ends after half a cycle.
    """
    closed = Gains(alpha_n_m=limits.optimal_friction(plant.modes))
    if plant.modes.is_single:
        return {"closed-form": closed, "exact": closed}

    target = exact.target_mode(plant.bare, plant.position, plant.modes)

    def ratio(alpha: float) -> float:
        return exact.stable_ratio(target.equivalent(friction_stiffness(alpha)))

    best = exact.best_gain(ratio, limits.largest_friction(plant.modes)).gain
    if best >= limits.holding_friction(plant.modes):
        best = limits.critical_friction(plant.modes)
    return {"closed-form": closed, "exact": Gains(alpha_n_m=best)}


def friction_assessment(plant: Plant, gains: Gains) -> Assessment:
    """Return the damping of the equivalent H = alpha (i 4/pi - 1) (4.24)."""
    modes, H = plant.modes, friction_stiffness(gains.alpha_n_m)
    without, with_frame = (exact.exact_equivalent(item, plant.position, modes, H) for item in (plant.bare, plant.frame))
    return Assessment(
        limits.damping_estimate(modes, H.real, H.imag),
        without.damping_ratio,
        with_frame.damping_ratio,
        unstable_pole_1_s=with_frame.unstable_pole,
    )


def friction_in_harmonic_motion(gains: Gains, x: FloatArray, v: FloatArray, amplitude_m: float) -> FloatArray:
    """Return f = alpha (sign(v) X - x)."""
    return np.asarray(gains.alpha_n_m * (np.sign(v) * amplitude_m - x))
