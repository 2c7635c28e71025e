"""Velocity and acceleration from displacement by differences."""

from __future__ import annotations

import numpy as np
from scipy import interpolate, signal

from mrpipe.artifacts import FloatArray


def backward_difference(values: FloatArray, dt: float) -> FloatArray:
    """Return (x(k) - x(k-1)) / dt with 0 at the first sample (thesis 2.5, 2.6): half a sample late."""
    return np.concatenate(([0.0], np.diff(values) / dt))


def central_difference(values: FloatArray, dt: float) -> FloatArray:
    """Return (x(k+1) - x(k-1)) / 2 dt, one-sided of second order at the ends; no delay."""
    if values.size < 3:
        return backward_difference(values, dt)
    return np.asarray(np.gradient(values, dt, edge_order=2))


def spline_derivatives(values: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Return the first and the second derivative of the cubic spline through all samples, shape (n,) each; no delay.

    A central difference loses (2 pi f dt)^2 / 6 of a sine of frequency f: 1 % at a twenty-fifth of the sampling rate.
    A spline loses less than a tenth of that.

    Parameters
    ----------
    values
        Shape (n,).
    dt
        Sampling interval [s].
    """
    spline = interpolate.CubicSpline(dt * np.arange(values.size), values)
    time = spline.x
    return np.asarray(spline(time, 1), dtype=np.float64), np.asarray(spline(time, 2), dtype=np.float64)


def savitzky_golay(
    values: FloatArray, dt: float, *, window_s: float, degree: int = 3, derivative: int = 1
) -> FloatArray:
    """Return the derivative of the polynomial fitted in a sliding window; no delay.

    Parameters
    ----------
    values
        Shape (n,).
    dt
        Sampling interval [s].
    window_s
        Length of the window [s]; widened to degree + 2 samples where shorter, and cut to the record.
    degree
        Degree of the polynomial.
    derivative
        1 for velocity, 2 for acceleration.
    """
    longest = values.size - 1 + values.size % 2
    length = min(max(round(window_s / dt) | 1, (degree + 2) | 1), longest)
    degree = min(degree, length - 1)
    return np.asarray(signal.savgol_filter(values, length, degree, deriv=derivative, delta=dt, mode="interp"))
