"""Parts of the compiled loop: constants of its arrays, perfect damper, sensors, record."""

from __future__ import annotations

import math

from numba import float64, njit, void

from mrpipe.artifacts import FloatArray
from mrpipe.control.kernel import (
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
    MEASURED_VELOCITY,
)

# --- how the desired force becomes a force ---
TRACK_DAMPER, TRACK_LAW, TRACK_SAMPLED = 0, 1, 2
TRACK_BOUC_WEN = 3  # as TRACK_DAMPER, for the plain chain of (2.1) to (2.4) without its function pointers

# --- numbers of the run ---
R_DT = 0
R_LAG = 1  # share of the difference to the command by which the driver moves in a step; 1 without lag
R_C = 2
R_K = 3
R_CLIPPED = 4  # 1: the force of a perfect damper is never active; 0: it follows the linear law
R_SIZE = 5

# --- integers of the run ---
I_STEPS = 0
I_PER_SAMPLE = 1
I_DELAY = 2
I_TRACK = 3
I_RECORD = 4  # plant steps between records
I_COMMAND = 5  # index in the state of the damper of the last command; -1: none
I_SIZE = 6

# --- columns of the record after the 2n of the state and the n absolute accelerations ---
T_FORCE = 0
T_DRIVE = 1
T_DESIRED = 2
T_GROUND = 3
T_WORK_IN = 4
T_WORK_DAMPER = 5
T_WORK_FRAME = 6
T_ENERGY = 7
T_SIZE = 8


@njit(float64(float64[::1], float64, float64), cache=True)
def ideal_force(run: FloatArray, x: float, v: float) -> float:
    """Return the force of a perfect damper: law (4.14), clipped by P2 (22) unless the run is linear."""
    force = run[R_C] * v + run[R_K] * x
    return force if run[R_CLIPPED] == 0.0 or force * v >= 0.0 else 0.0


# parameters and state of the plain chain: lag, polynomials, hysteresis, sum
P_ETA, P_YIELD, P_VISCOSITY, P_YIELD_DISPLACEMENT, P_GAMMA_SHARE, P_EXPONENT = 0, 1, 5, 9, 10, 11
D_CURRENT, D_COMMAND = 0, 1
BOUC_WEN = ("driver-lag", "polynomial-coefficients", "hysteresis", "sum")


@njit(void(float64[:, ::1], float64[::1], float64[::1]), cache=True)
def multiply(transposed: FloatArray, z: FloatArray, result: FloatArray) -> None:
    """Write A z; by columns of A, so that the inner loop runs along memory without a sum."""
    for row in range(result.shape[0]):
        result[row] = 0.0
    for column in range(z.shape[0]):
        value = z[column]
        for row in range(result.shape[0]):
            result[row] += transposed[column, row] * value


@njit(float64(float64[:, ::1], float64[::1]), cache=True)
def quadratic(A: FloatArray, z: FloatArray) -> float:
    """Return z'A z."""
    total = 0.0
    for row in range(z.shape[0]):
        part = 0.0
        for column in range(z.shape[0]):
            part += A[row, column] * z[column]
        total += part * z[row]
    return total


@njit(void(float64[::1], float64[::1], float64[::1]), cache=True)
def apply_faults(noise: FloatArray, before: FloatArray, measured: FloatArray) -> None:
    """Replace the readings of faulty sensors.

    In the noise, plus infinity marks a reading that repeats the last one (`before`), and minus infinity a reading of 0.
    """
    for channel in range(noise.shape[0]):
        if noise[channel] == math.inf:
            measured[channel] = before[channel]
        elif noise[channel] == -math.inf:
            measured[channel] = 0.0


@njit(
    void(
        float64[:, ::1], float64[::1], float64[::1], float64[::1], float64, float64, float64[::1], float64[::1],
    ),
    cache=True,
)  # fmt: skip
def sense(
    lower: FloatArray, gain: FloatArray, w: FloatArray, z: FloatArray, force: float, ground: float,
    noise: FloatArray, measured: FloatArray,
) -> None:  # fmt: skip
    """Fill the readings of the sensors; `lower` is the transposed lower half of A, `gain` the accelerations of 1 N."""
    before = measured.copy()
    n = w.shape[0]
    floors = measured[MEASURED_FLOORS:]
    multiply(lower, z, floors)
    x, v, a = 0.0, 0.0, 0.0
    for floor in range(n):
        floors[floor] += gain[floor] * force
        x += w[floor] * z[floor]
        v += w[floor] * z[n + floor]
        # difference of a floor's and the ground's accelerometer
        a += w[floor] * (floors[floor] - ground)
        floors[floor] += noise[MEASURED_FLOORS + floor]
    measured[MEASURED_GROUND] = ground + noise[MEASURED_GROUND]
    measured[MEASURED_DISPLACEMENT] = x + noise[MEASURED_DISPLACEMENT]
    measured[MEASURED_VELOCITY] = v + noise[MEASURED_VELOCITY]
    measured[MEASURED_FORCE] = force + noise[MEASURED_FORCE]
    measured[MEASURED_ACCELERATION] = a + noise[MEASURED_ACCELERATION]
    apply_faults(noise, before, measured)


@njit(
    void(float64[:, ::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[::1], float64, float64[::1]),
    cache=True,
)  # fmt: skip
def note(
    lower: FloatArray, gain: FloatArray, M: FloatArray, K: FloatArray, z: FloatArray, force: float, row: FloatArray
) -> None:
    """Write state, absolute accelerations and stored energy into a row of the record."""
    n = gain.shape[0]
    for index in range(2 * n):
        row[index] = z[index]
    accelerations = row[2 * n : 3 * n]
    multiply(lower, z, accelerations)
    for floor in range(n):
        accelerations[floor] += gain[floor] * force
    row[3 * n + T_ENERGY] = 0.5 * (quadratic(M, z[n:]) + quadratic(K, z[:n]))
