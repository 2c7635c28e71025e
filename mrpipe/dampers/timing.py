"""Interpolation of recorded motion between its samples."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, njit, void

from mrpipe.artifacts import FloatArray, IntArray


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def between(first: float, second: float, first_slope: float, second_slope: float, part: float) -> float:
    """Return the cubic through two values and slopes (per interval) at `part` of the interval (Hermite)."""
    rise = second - first
    return first + part * (
        first_slope
        + part * (3.0 * rise - 2.0 * first_slope - second_slope + part * (first_slope + second_slope - 2.0 * rise))
    )


@njit(void(float64[::1], float64[::1], float64[::1], int64[::1], float64[::1], float64, float64[:, ::1]), cache=True)
def _shifted(
    displacement: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    starts: IntArray,
    dt: FloatArray,
    time: float,
    result: FloatArray,
) -> None:
    for test in range(starts.shape[0] - 1):
        begin, last, step = starts[test], starts[test + 1] - 1, dt[test]
        whole = math.floor(time / step)
        part = time / step - whole
        for index in range(begin, last + 1):
            at = index + whole
            if at < begin or at >= last:
                # beyond the record the motion continues as at its end
                end = begin if at < begin else last
                rest = (at + part - end) * step
                result[0, index] = displacement[end] + rest * velocity[end]
                result[1, index] = velocity[end]
                result[2, index] = 0.0
            else:
                result[0, index] = between(
                    displacement[at], displacement[at + 1], step * velocity[at], step * velocity[at + 1], part
                )
                result[1, index] = (1.0 - part) * velocity[at] + part * velocity[at + 1]
                result[2, index] = (1.0 - part) * acceleration[at] + part * acceleration[at + 1]


def look_ahead(
    displacement: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    starts: IntArray,
    dt: FloatArray,
    time_s: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the motion `time_s` after (below 0: before) each sample.

    The displacement follows the cubic through displacements and velocities, because micrometres matter at a reversal,
    and a series in the derivatives would be inaccurate for fast motion.

    Parameters
    ----------
    displacement, velocity, acceleration
        Concatenated tests, shape (n,); m, m/s, m/s^2.
    starts
        First sample of each test, and n; shape (tests + 1,).
    dt
        Sampling interval of each test [s], shape (tests,).
    time_s
        Time shift of each sample, shape (n,) [s].

    Returns
    -------
    Displacement, velocity and acceleration, shape (n,) each.
    """
    result = np.empty((3, len(displacement)))
    _shifted(displacement, velocity, acceleration, starts, dt, time_s, result)
    return result[0], result[1], result[2]
