"""Functions that the laws with a state observer share: z+ = F z + g f + H y, u = -k z."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control import exact
from mrpipe.control.kernel import (
    AT_OBSERVER,
    FLOORS,
    LAW_SIGNATURE,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
    OBSERVER_FORCE,
    S_FORCE,
    STATE_OBSERVER,
)
from mrpipe.control.law import Assessment, Plant


@njit(float64(float64[::1], int64[::1], float64[::1], float64[::1], float64), cache=True)
def observe(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray, force: float) -> float:
    """Advance the observer with the damper force [N] that is held over the coming sample, and return -k z.

    `y` is the damper displacement, the ground acceleration and the absolute acceleration of each floor.
    """
    floors = layout[FLOORS]
    n = 2 * floors
    outputs = floors + 2
    at_f, at_g = layout[AT_OBSERVER], layout[AT_OBSERVER] + n * n
    at_h = at_g + n
    at_k = at_h + n * outputs
    at = layout[STATE_OBSERVER]
    new = np.zeros(n)
    for row in range(n):
        total = numbers[at_g + row] * force + numbers[at_h + row * outputs] * measured[MEASURED_DISPLACEMENT]
        for column in range(n):
            total += numbers[at_f + row * n + column] * state[at + column]
        total += numbers[at_h + row * outputs + 1] * measured[MEASURED_GROUND]
        for column in range(floors):
            total += numbers[at_h + row * outputs + 2 + column] * measured[MEASURED_FLOORS + column]
        new[row] = total
    answer = 0.0
    for row in range(n):
        state[at + row] = new[row]
        answer -= numbers[at_k + row] * new[row]
    return answer


@njit(LAW_SIGNATURE, cache=True)
def regulator_force(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Return -k z; the observer takes the measured force of the damper, or the desired force of the last sample."""
    force = measured[MEASURED_FORCE] if layout[OBSERVER_FORCE] == 1 else state[S_FORCE]
    return observe(numbers, layout, state, measured, force)


C_OBSERVE = """\
static double observe(double *state, const double *measured, double force)
{
    const int floors = layout[FLOORS], n = 2 * floors, outputs = floors + 2;
    const double *f = numbers + layout[AT_OBSERVER], *g = f + n * n, *h = g + n, *k = h + n * outputs;
    double *z = state + layout[STATE_OBSERVER];
    double fresh[OBSERVER_SIZE] = {0.0}, answer = 0.0;
    for (int row = 0; row < n; ++row) {
        double total = g[row] * force + h[row * outputs] * measured[MEASURED_DISPLACEMENT];
        for (int column = 0; column < n; ++column) total += f[row * n + column] * z[column];
        total += h[row * outputs + 1] * measured[MEASURED_GROUND];
        for (int column = 0; column < floors; ++column)
            total += h[row * outputs + 2 + column] * measured[MEASURED_FLOORS + column];
        fresh[row] = total;
    }
    for (int row = 0; row < n; ++row) {
        z[row] = fresh[row];
        answer -= k[row] * fresh[row];
    }
    return answer;
}
"""

C_BODY = """\
    return observe(state, measured, layout[OBSERVER_FORCE] == 1 ? measured[MEASURED_FORCE] : state[S_FORCE]);
"""


def regulator_assessment(plant: Plant, gain: FloatArray) -> Assessment:
    """Follow the pole of the target mode while the unclipped u = -k z, shape (2n,), increases from zero."""
    without, with_frame = (
        exact.target_mode(item, plant.position, plant.modes).feedback(gain) for item in (plant.bare, plant.frame)
    )
    return Assessment(
        damping_ratio_exact=without.damping_ratio,
        damping_ratio_with_frame=with_frame.damping_ratio,
        unstable_pole_1_s=with_frame.unstable_pole,
    )
