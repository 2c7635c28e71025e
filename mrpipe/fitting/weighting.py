"""Weights of the samples that a fit compares, and rows that are weighted and centred with them in one compiled loop.

Each test has an offset. The best offset makes the weighted mean of the residual zero, so that an offset is projected
out of a row by taking the weighted mean of each test off.
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
        Places of the samples compared, shape (m,).
    root
        Square roots of their weights, shape (m,) [1/N].
    starts
        Where each test begins among them, and their number, shape (tests + 1,).
    sums
        Sum of the weights of each test, shape (tests,) [1/N^2].
    test
        Test of each sample compared, shape (m,).
    samples
        Number of all samples, n.
    target
        Weighted force without its weighted mean in each test, shape (m,).
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
    """Return the samples that a problem compares, their weights, and the measured force at them."""
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
        If the rows are not at all samples: compiled code does not examine its bounds.
    """
    if columns.shape[1] != w.samples:
        raise ValueError(f"the rows have {columns.shape[1]} samples, the weighting is of {w.samples}")
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
