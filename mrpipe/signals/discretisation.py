"""Exact steps of a linear system z' = A z + B u between samples, by the matrix exponential (Van Loan 1978).

The virtual laboratory has a separate step (:mod:`mrpipe.laboratory.structure`) on purpose, so that an error in this
module cannot appear in the measurements as well and hide.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from mrpipe.artifacts import FloatArray


def discretise_zero_order(A: FloatArray, B: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Return Ad, Bd of the exact step with inputs constant over `dt` [s]: z+ = Ad z + Bd u."""
    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n] = A
    block[:n, n:] = B
    step = expm(block * dt)
    return np.asarray(step[:n, :n]), np.asarray(step[:n, n:])


def discretise_first_order(A: FloatArray, B: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Ad, B0, B1 of the exact step with inputs linear over `dt` [s]: z+ = Ad z + B0 u + B1 u+."""
    n, m = B.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n] = A * dt
    block[:n, n : n + m] = B * dt
    block[n : n + m, n + m :] = np.eye(m)
    step = expm(block)
    ramp = step[:n, n + m :]
    return np.asarray(step[:n, :n]), np.asarray(step[:n, n : n + m] - ramp), np.asarray(ramp)
