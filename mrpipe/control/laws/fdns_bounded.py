"""Friction with negative stiffness that accounts for the residual and the largest force of the damper.

The force of the damper lies between its residual force F0 and its largest force F1. Over a half cycle these bounds
limit the force alpha (X - x), so that the dissipated energy differs from the 2 alpha X^2 of the law. This law scales
alpha such that the bounded force dissipates 2 alpha X^2.
"""

from __future__ import annotations

import math

from numba import float64, njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import (
    GAIN_ALPHA,
    LARGEST_FORCE,
    LAW_SIGNATURE,
    RESIDUAL_FORCE,
    ROUNDING,
    S_AMPLITUDE,
    S_DIRECTION,
    S_V,
    S_X,
)
from mrpipe.control.law import Law
from mrpipe.control.laws._friction import FRICTION, friction_assessment, friction_candidates

STEEPEST = 64.0
"""Largest factor by which alpha is scaled."""


@njit(float64(float64, float64, float64, float64), cache=True)
def bounded_energy(slope: float, amplitude: float, lowest: float, highest: float) -> float:
    """Return the integral of slope u, limited to between two forces, for u from 0 to twice the amplitude [J]."""
    way = 2.0 * amplitude
    first = min(lowest / slope, way)
    last = min(highest / slope, way)
    return lowest * first + 0.5 * slope * (last * last - first * first) + highest * (way - last)


@njit(float64(float64, float64, float64, float64), cache=True)
def bounded_slope(alpha: float, amplitude: float, lowest: float, highest: float) -> float:
    """Return the slope whose bounded force dissipates 2 alpha X^2 in a half cycle; 0 if the residual force suffices."""
    wanted = 2.0 * alpha * amplitude * amplitude
    if wanted <= 2.0 * lowest * amplitude or alpha <= 0.0:
        return 0.0
    low, high = 0.0, STEEPEST * alpha
    if bounded_energy(high, amplitude, lowest, highest) <= wanted:
        return high
    for _ in range(60):
        middle = 0.5 * (low + high)
        if bounded_energy(middle, amplitude, lowest, highest) < wanted:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(LAW_SIGNATURE, cache=True)
def fdns_bounded(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Return f = alpha' (sign(v) X - x) with alpha' by :func:`bounded_slope`."""
    amplitude = max(state[S_AMPLITUDE], abs(state[S_X]))
    slope = bounded_slope(numbers[GAIN_ALPHA], amplitude, numbers[RESIDUAL_FORCE], numbers[LARGEST_FORCE])
    side = state[S_DIRECTION]
    if numbers[ROUNDING] > 0.0:
        side = math.tanh(state[S_V] / numbers[ROUNDING])
    return slope * (side * amplitude - state[S_X])


C_HELPERS = """\
static double bounded_energy(double slope, double amplitude, double lowest, double highest)
{
    const double way = 2.0 * amplitude;
    const double first = smaller(lowest / slope, way), last = smaller(highest / slope, way);
    return lowest * first + 0.5 * slope * (last * last - first * first) + highest * (way - last);
}

static double bounded_slope(double alpha, double amplitude, double lowest, double highest)
{
    const double wanted = 2.0 * alpha * amplitude * amplitude;
    if (wanted <= 2.0 * lowest * amplitude || alpha <= 0.0) return 0.0;
    double low = 0.0, high = 64.0 * alpha;
    if (bounded_energy(high, amplitude, lowest, highest) <= wanted) return high;
    for (int turn = 0; turn < 60; ++turn) {
        const double middle = 0.5 * (low + high);
        if (bounded_energy(middle, amplitude, lowest, highest) < wanted)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}
"""

LAW = Law(
    name="fdns-bounded",
    summary="fdns that accounts for the residual and the largest force of the damper",
    source="future work named in P2; energy balance over a half cycle in the file of the law",
    force=fdns_bounded,
    c_body="""\
    const double amplitude = larger(state[S_AMPLITUDE], fabs(state[S_X]));
    const double slope = bounded_slope(numbers[GAIN_ALPHA], amplitude, numbers[RESIDUAL_FORCE], numbers[LARGEST_FORCE]);
    const double side = numbers[ROUNDING] > 0.0 ? tanh(state[S_V] / numbers[ROUNDING]) : state[S_DIRECTION];
    return slope * (side * amplitude - state[S_X]);
""",
    c_helpers=C_HELPERS,
    gains=(FRICTION,),
    signs={"alpha_n_m": 1.0},
    candidates=friction_candidates,
    assess=friction_assessment,
)
