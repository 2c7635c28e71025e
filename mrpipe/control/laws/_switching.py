"""Functions that the laws share which switch the largest drive on and off by the measured damper force.

Signs: the damper force f is positive where it resists, so the force on the structure along w is -f. Jansen and Dyke
(2000) write the same laws for the force on the structure.
"""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.gains import Gains
from mrpipe.control.kernel import AT_LAW, FLOORS, MEASURED_FLOORS, STATE_LAW
from mrpipe.control.law import GainRange

CORNER_SHARE = 0.1
"""Ratio of the corner frequency of the integration of accelerations to the free frequency of the target mode."""

CORNER = GainRange(
    "corner_rad_s",
    "corner frequency of the velocity that is integrated from accelerations",
    lambda plant: (0.02 * plant.modes.omega_0, 0.3 * plant.modes.omega_0),
)


@njit(float64(float64[::1], int64[::1], float64[::1], float64[::1]), cache=True)
def absolute_velocity(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:
    """Return the absolute velocity along the damper [m/s], integrated from the accelerometers of the floors.

    The integral decays below the corner frequency, because an accelerometer has a bias. The numbers of the law are the
    sample time, the decay factor per sample, and the connectivity vector w.
    """
    at, memory = layout[AT_LAW], layout[STATE_LAW]
    total = 0.0
    for floor in range(layout[FLOORS]):
        total += numbers[at + 2 + floor] * measured[MEASURED_FLOORS + floor]
    state[memory] = numbers[at + 1] * (state[memory] + 0.5 * numbers[at] * (total + state[memory + 1]))
    state[memory + 1] = total
    return state[memory]


C_ABSOLUTE_VELOCITY = """\
static double absolute_velocity(double *state, const double *measured)
{
    const double *own = numbers + layout[AT_LAW];
    double *memory = state + layout[STATE_LAW], total = 0.0;
    for (int floor = 0; floor < layout[FLOORS]; ++floor) total += own[2 + floor] * measured[MEASURED_FLOORS + floor];
    memory[0] = own[1] * (memory[0] + 0.5 * own[0] * (total + memory[1]));
    memory[1] = total;
    return memory[0];
}
"""


def integration_numbers(gains: Gains, position: FloatArray | None, dt: float) -> FloatArray:
    """Return the sample time, the decay factor per sample, and the connectivity vector, shape (2 + n,)."""
    w = np.zeros(0) if position is None else np.asarray(position, dtype=np.float64)
    return np.concatenate([[dt, math.exp(-dt * gains.get("corner_rad_s", 0.0))], w])
