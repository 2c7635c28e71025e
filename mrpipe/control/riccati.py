"""Gains of linear-quadratic regulators and of Kalman filters, from their Riccati equations.

All functions raise the errors of scipy (`LinAlgError`, `ValueError`) if the equation has no stabilising solution.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_are, solve_discrete_are

from mrpipe.artifacts import FloatArray


def regulator_gain(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, S: FloatArray | None = None
) -> FloatArray:
    """Return K of u = -K x, shape (k, n), that minimises the integral of x'Qx + 2 x'S u + u'R u.

    Parameters
    ----------
    A, B
        Matrices of x' = A x + B u, shapes (n, n), (n, k).
    Q, R, S
        Shapes (n, n), (k, k), (n, k); without S there is no mixed term.
    """
    P = solve_continuous_are(A, B, Q, R, s=S)
    return np.asarray(np.linalg.solve(R, B.T @ P if S is None else B.T @ P + S.T))


def kalman_bucy_gain(A: FloatArray, C: FloatArray, Q: FloatArray, R: FloatArray, S: FloatArray) -> FloatArray:
    """Return L of the continuous filter x^' = A x^ + L (y - C x^), shape (n, p).

    Parameters
    ----------
    A, C
        Shapes (n, n), (p, n).
    Q, R, S
        Spectral densities of the noise of the states (n, n) and of the measurements (p, p), and between them (n, p).
    """
    P = solve_continuous_are(A.T, C.T, 0.5 * (Q + Q.T), 0.5 * (R + R.T), s=S)
    return np.asarray(np.linalg.solve(R, C @ P + S.T).T)


def predictor_gain(A: FloatArray, C: FloatArray, W: FloatArray, V: FloatArray) -> FloatArray:
    """Return the steady L of the discrete predictor x+ = A x + L (y - C x), shape (n, p).

    Parameters
    ----------
    A, C
        Matrices of a sampled system, shapes (n, n), (p, n).
    W, V
        Covariances of the noise of the states (n, n) and of the measurements (p, p).
    """
    P = solve_discrete_are(A.T, C.T, W, V)
    return np.asarray(A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + V))
