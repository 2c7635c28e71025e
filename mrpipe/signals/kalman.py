"""Kinematic Kalman filter: velocity from displacement and acceleration, without a model of the damper.

Thesis (5.1) to (5.3), with the acceleration as the input that the printed (5.3) leaves out (errata row 12):

    x1' = x2 + k (y - x1)
    x2' = a - b + l (y - x1)
    b'  = -m (y - x1)

x1 displacement, x2 velocity, b bias of the accelerometer (optional, m = 0 without), y and a measured.

Discretisation. Between two samples, y and a are taken as linear in time. The solution is then exact and has no
additional delay: with A = [[-k, 1, 0], [-l, 0, -1], [m, 0, 0]], B = [[k, 0], [l, 1], [-m, 0]] and u = (y, a),

    s(n) = F s(n-1) + G0 u(n-1) + G1 u(n)

F = exp(A dt), and G0, G1 the integrals of exp(A (dt - t)) B against 1 - t/dt and t/dt. :func:`discretise` gives F, G0
and G1; :func:`kinematic_kalman` runs the recursion, which can also run sample by sample in a control loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.signals.discretisation import discretise_first_order


@dataclass(frozen=True)
class KalmanGains:
    """Steady gains k [1/s], l [1/s^2] and, with a bias state, m [1/s^3]."""

    k: float
    l: float  # noqa: E741 - the thesis' letter
    m: float = 0.0


def continuous_kalman_gains(
    displacement_noise_m: float, acceleration_noise_m_s2: float, bias_drift_m_s2: float = 0.0, rate_hz: float = 1.0
) -> KalmanGains:
    """Return the gains from the standard deviations of noise that is white at one and the same sampling rate.

    Without a bias state l = sigma_a / sigma_x and k = sqrt(2 l) (errata D). With one, k, l and m are the coefficients
    of the stable half of s^6 + (sigma_a/sigma_x)^2 s^2 - (sigma_b/sigma_x)^2, where the Riccati equation leads; sigma_b
    is the noise of the rate of the bias at the same sampling rate [m/s^3], the drift times the root of the rate.
    :func:`mrpipe.control.kalman.discrete_kalman_gains` gives the gains of a filter that runs at samples.

    Parameters
    ----------
    displacement_noise_m, acceleration_noise_m_s2
        Above zero.
    bias_drift_m_s2
        Standard deviation of the change of the bias in one second, a random walk [m/s^2]; 0: no bias state.
    rate_hz
        Sampling rate of the noise [Hz]; it matters for the drift only.

    Raises
    ------
    ValueError
        If a noise level is not above zero.
    """
    if not (displacement_noise_m > 0.0 and acceleration_noise_m_s2 > 0.0 and bias_drift_m_s2 >= 0.0):
        raise ValueError("noise levels must be above zero")
    ratio = acceleration_noise_m_s2 / displacement_noise_m
    if bias_drift_m_s2 == 0.0:
        return KalmanGains(math.sqrt(2.0 * ratio), ratio)
    drift = bias_drift_m_s2 * math.sqrt(rate_hz) / displacement_noise_m
    roots = np.roots([1.0, 0.0, 0.0, 0.0, ratio**2, 0.0, -(drift**2)])
    stable = sorted(roots, key=lambda root: root.real)[:3]
    coefficients = np.real(np.poly(stable))
    return KalmanGains(*(float(value) for value in coefficients[1:]))


def discretise(gains: KalmanGains, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return F (3, 3), G0 (3, 2) and G1 (3, 2) of the recursion in the head of this module."""
    state = np.array([[-gains.k, 1.0, 0.0], [-gains.l, 0.0, -1.0], [gains.m, 0.0, 0.0]])
    inputs = np.array([[gains.k, 0.0], [gains.l, 1.0], [-gains.m, 0.0]])
    return discretise_first_order(state, inputs, dt)


@numba.njit(cache=True)
def _run(
    displacement: FloatArray,
    acceleration: FloatArray,
    transition: FloatArray,
    previous: FloatArray,
    present: FloatArray,
    start: FloatArray,
    states: FloatArray,
) -> None:
    states[0] = start
    for n in range(1, displacement.size):
        for i in range(3):
            states[n, i] = (
                transition[i, 0] * states[n - 1, 0]
                + transition[i, 1] * states[n - 1, 1]
                + transition[i, 2] * states[n - 1, 2]
                + previous[i, 0] * displacement[n - 1]
                + previous[i, 1] * acceleration[n - 1]
                + present[i, 0] * displacement[n]
                + present[i, 1] * acceleration[n]
            )


def kinematic_kalman(
    displacement: FloatArray,
    acceleration: FloatArray,
    dt: float,
    gains: KalmanGains,
    *,
    start: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Estimate displacement, velocity and accelerometer bias, causally.

    Parameters
    ----------
    displacement, acceleration
        Measured [m], [m/s^2], shape (n,).
    dt
        Sampling interval [s].
    gains
        See :func:`continuous_kalman_gains`.
    start
        First state (displacement, velocity, bias); by default the first displacement, at rest, without bias. An error
        of this state decays within about 5/k.

    Returns
    -------
    tuple
        Displacement [m], velocity [m/s] and bias [m/s^2], each of shape (n,).
    """
    first = np.array([displacement[0], 0.0, 0.0]) if start is None else np.asarray(start, dtype=np.float64)
    transition, previous, present = discretise(gains, dt)
    states = np.empty((displacement.size, 3))
    _run(
        np.ascontiguousarray(displacement, dtype=np.float64),
        np.ascontiguousarray(acceleration, dtype=np.float64),
        transition,
        previous,
        present,
        first,
        states,
    )
    return states[:, 0].copy(), states[:, 1].copy(), states[:, 2].copy()


def kinematic_smoother(
    displacement: FloatArray, acceleration: FloatArray, dt: float, gains: KalmanGains
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean of the estimates of :func:`kinematic_kalman` forward and backward in time: no delay.

    A constant bias of the accelerometer changes the two velocities by opposite amounts and cancels in the mean.
    """
    ahead = kinematic_kalman(displacement, acceleration, dt, gains)
    # the last state of the forward run starts the backward run, so that only the first few samples have an inaccurate
    # start
    last = np.array([ahead[0][-1], -ahead[1][-1], ahead[2][-1]])
    back = kinematic_kalman(displacement[::-1], acceleration[::-1], dt, gains, start=last)
    settled = min(displacement.size, math.ceil(5.0 / (gains.k * dt)))
    weight = np.full(displacement.size, 0.5)
    weight[:settled] = np.linspace(0.0, 0.5, settled)
    return (
        weight * ahead[0] + (1.0 - weight) * back[0][::-1],
        weight * ahead[1] - (1.0 - weight) * back[1][::-1],
        weight * ahead[2] + (1.0 - weight) * back[2][::-1],
    )
