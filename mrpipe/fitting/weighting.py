"""Weights of the samples that a fit compares, and compiled weighting and centring of rows.

Each test has an offset. With the best offset the weighted mean of the residual is zero. An offset is therefore
projected out of a row by subtracting the weighted mean of each test.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import float64, int64, njit, void

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.fitting.problem import Problem


@dataclass(frozen=True)
class Weighting:
    """The samples compared, their weights, and the measured force at them.

    Attributes
    ----------
    at
        Indices of the samples that are compared, shape (m,).
    root
        Square roots of their weights, shape (m,) [1/N].
    starts
        Position of the first sample of each test among them, and m, shape (tests + 1,).
    sums
        Sum of the weights of each test, shape (tests,) [1/N^2].
    test
        Index of the test of each of these samples, shape (m,).
    samples
        Number of all samples, n.
    target
        Weighted force minus its weighted mean in each test, shape (m,) [1].
    target_means
        Weighted mean of the force in each test, shape (tests,) [N].
    """

    at: IntArray
    root: FloatArray
    starts: IntArray
    sums: FloatArray
    test: IntArray
    samples: int
    target: FloatArray
    target_means: FloatArray


def weighting(problem: Problem) -> Weighting:
    """Return the samples that a problem compares, with their weights and the measured force."""
    at = np.flatnonzero(problem.root_weight)
    root = np.ascontiguousarray(problem.root_weight[at])
    test = problem.recordings.test[at] if problem.offsets else np.zeros(len(at), dtype=np.int64)
    first = np.unique(test, return_index=True)[1].astype(np.int64)
    sums = np.add.reduceat(root**2, first)
    starts = np.append(first, len(at))
    target, means = _centred(problem.recordings.force[None], at, root, starts, sums)
    return Weighting(at, root, starts, sums, test, len(problem.recordings.force), target[0], means[0])


def centred(columns: FloatArray, w: Weighting) -> tuple[FloatArray, FloatArray]:
    """Return weighted rows without their weighted mean in each test, and these means.

    Parameters
    ----------
    columns
        Rows at all samples, shape (c, n).
    w
        The samples compared.

    Returns
    -------
    Rows at the samples compared, shape (c, m), and means, shape (c, tests).

    Raises
    ------
    ValueError
        If the rows do not have n samples. The compiled code does not check array bounds.
    """
    if columns.shape[1] != w.samples:
        raise ValueError(f"the rows have {columns.shape[1]} samples, but the weighting is for {w.samples} samples")
    return _centred(columns, w.at, w.root, w.starts, w.sums)


def _centred(
    columns: FloatArray, at: IntArray, root: FloatArray, starts: IntArray, sums: FloatArray
) -> tuple[FloatArray, FloatArray]:
    rows, means = np.empty((len(columns), len(at))), np.empty((len(columns), len(sums)))
    _centre(np.ascontiguousarray(columns), at, root, starts, sums, rows, means)
    return rows, means


@njit(
    void(float64[:, ::1], int64[::1], float64[::1], int64[::1], float64[::1], float64[:, ::1], float64[:, ::1]),
    cache=True,
    nogil=True,
    fastmath={"reassoc", "contract"},
)
def _centre(
    columns: FloatArray,
    at: IntArray,
    root: FloatArray,
    starts: IntArray,
    sums: FloatArray,
    rows: FloatArray,
    means: FloatArray,
) -> None:
    for row in range(columns.shape[0]):
        for test in range(sums.shape[0]):
            total = 0.0
            for k in range(starts[test], starts[test + 1]):
                value = columns[row, at[k]]
                rows[row, k] = value
                total += value * root[k] * root[k]
            mean = total / sums[test]
            means[row, test] = mean
            for k in range(starts[test], starts[test + 1]):
                rows[row, k] = (rows[row, k] - mean) * root[k]
