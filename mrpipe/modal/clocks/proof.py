"""Validation of a clock error by frequencies that were left out of its estimate.

One delay shifts the phases of all modes of a sensor in proportion to their frequency. A delay that is estimated without
the lines around one mode must therefore improve the fit of that mode. An error of the model, such as a mode that was
not found, disturbs the phase of one mode alone and predicts nothing about the others.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray

_ROWS_PER_COLUMN = 2
"""Ratio of rows of a part to columns of the basis below which the part is joined with its neighbour."""
_LEAST_EIGENVALUE = 1e-9


def parts_by_mode(omega: FloatArray, poles: FloatArray, columns: int) -> list[IntArray]:
    """Return the indices of the lines around each mode; parts with few lines are joined.

    Parameters
    ----------
    omega
        Lines, shape (m,) [rad/s].
    poles
        Angular frequencies of the modes, rising, shape (r,) [rad/s].
    columns
        Columns of the linear basis.
    """
    edges = np.sqrt(poles[1:] * poles[:-1])
    number = np.searchsorted(edges, omega)
    parts: list[IntArray] = []
    waiting = np.empty(0, dtype=np.int64)
    for index in range(poles.size):
        waiting = np.concatenate([waiting, np.flatnonzero(number == index)])
        # real and imaginary part of a line are two rows
        if 2 * waiting.size >= _ROWS_PER_COLUMN * columns:
            parts.append(waiting)
            waiting = np.empty(0, dtype=np.int64)
    if parts and waiting.size:
        parts[-1] = np.concatenate([parts[-1], waiting])
    return parts


class LeftOut:
    """Costs of delays on parts of the lines that the delays were not estimated from."""

    def __init__(self, basis: FloatArray, parts: Sequence[IntArray]) -> None:
        """Take an orthonormal basis of the real-valued rows, shape (2 m, c), and the parts of the m lines."""
        lines = basis.shape[0] // 2
        self.basis = basis
        self.rows = [np.concatenate([part, part + lines]) for part in parts]
        grams = [basis[rows].T @ basis[rows] for rows in self.rows]
        self.inside = [_inverse(gram) for gram in grams]
        self.outside = [_inverse(np.eye(basis.shape[1]) - gram) for gram in grams]

    def costs(self, trials: Sequence[FloatArray]) -> FloatArray:
        """Return the cost of each part, with the delay estimated from the other parts, shape (parts,).

        Parameters
        ----------
        trials
            For each form of the delay (such as places of a step): the residual and its derivatives, shape
            (2 m, 1 + k), without the part that the basis explains. The other parts choose the form as well.
        """
        found = np.empty(len(self.rows))
        least = np.full(len(self.rows), np.inf)
        for columns in trials:
            every, along = columns.T @ columns, self.basis.T @ columns
            for index, rows in enumerate(self.rows):
                own, own_along = columns[rows].T @ columns[rows], self.basis[rows].T @ columns[rows]
                rest = along - own_along
                gram = every - own - rest.T @ self.outside[index] @ rest
                change = np.concatenate([[1.0], -np.linalg.lstsq(gram[1:, 1:], gram[1:, 0], rcond=None)[0]])
                cost = float(change @ gram @ change)
                if cost < least[index]:
                    least[index] = cost
                    found[index] = float(change @ (own - own_along.T @ self.inside[index] @ own_along) @ change)
        return found

    def proves(self, better: FloatArray, worse: FloatArray) -> bool:
        """Return whether one delay predicts the parts better than another, also without the part of largest gain."""
        sizes = np.array([rows.size for rows in self.rows])
        gains = sizes * np.log(np.maximum(worse, 1e-300) / np.maximum(better, 1e-300))
        return bool(gains.sum() > 0.0 and gains.sum() - gains.max(initial=0.0) > 0.0)


def _inverse(gram: FloatArray) -> FloatArray:
    """Return the pseudo-inverse of a symmetric matrix whose eigenvalues are between 0 and 1."""
    values, vectors = np.linalg.eigh(gram)
    kept = values > _LEAST_EIGENVALUE
    return np.asarray((vectors[:, kept] / values[kept]) @ vectors[:, kept].T)
