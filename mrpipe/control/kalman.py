"""Gains of the kinematic Kalman filter, which estimates velocity from displacement and acceleration (thesis 5.2)."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_discrete_are

from mrpipe.artifacts import FloatArray


def discrete_kalman_gains(
    displacement_noise_m: float, acceleration_noise_m_s2: float, dt: float, bias_drift_m_s2: float = 0.0
) -> FloatArray:
    """Return the steady gains on displacement [1], velocity [1/s] and acceleration bias [1/s^2], shape (3,).

    The filter is discrete: x- = x + dt v + dt2/2 (a - b), v- = v + dt (a - b), where a is the mean of the acceleration
    over the interval. For short intervals gains/dt tend to those of
    :func:`mrpipe.signals.kalman.continuous_kalman_gains`.

    Parameters
    ----------
    displacement_noise_m, acceleration_noise_m_s2
        RMS noise of a sample of each sensor [m], [m/s^2].
    dt
        Interval [s].
    bias_drift_m_s2
        Standard deviation of the change of the bias in one second, a random walk [m/s^2]; 0: no bias state.
    """
    size = 3 if bias_drift_m_s2 > 0.0 else 2
    A = np.eye(size)
    A[0, 1] = dt
    G = np.zeros((size, 1))
    G[0, 0], G[1, 0] = 0.5 * dt**2, dt
    Q = acceleration_noise_m_s2**2 * (G @ G.T)
    if size == 3:
        A[:2, 2] = -G[:2, 0]
        Q[2, 2] = bias_drift_m_s2**2 * dt
    C = np.zeros((1, size))
    C[0, 0] = 1.0
    R = np.array([[displacement_noise_m**2]])
    P = solve_discrete_are(A.T, C.T, Q, R)
    gains = np.zeros(3)
    gains[:size] = (P @ C.T / (C @ P @ C.T + R))[:, 0]
    return gains
