"""Where a residual stands out of the noise: groups of lines, and shares over those that do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.discrepancy.frame_fit import Design

LINES_OF_A_GROUP = 24
FLAG_P = 1e-5
"""A group stands out where noise alone would make it so once in this many trials, all groups together."""


@dataclass(frozen=True)
class Groups:
    """Groups of neighbouring lines of a record and storey.

    Attributes
    ----------
    index
        Group of each weighted residual, shape (n, 2 b).
    count
        Lines of each group (real and imaginary), shape (g,).
    scale
        Mean square of the noise of each storey's residual, shape (n,): 1 where the sensors' noise is what was reckoned.
    storey
        Storey of each group, shape (g,).
    flagged
        Groups that stand out of the noise, shape (g,).
    """

    index: IntArray
    count: FloatArray
    scale: FloatArray
    storey: IntArray
    flagged: BoolArray
    record: IntArray

    def mean_square(self, residual: FloatArray) -> FloatArray:
        """Return the mean square of each group over that of the noise, shape (g,)."""
        sums = np.bincount(self.index.ravel(), weights=(residual**2).ravel(), minlength=len(self.count))
        return np.asarray(sums / self.count / self.scale[self.storey])

    def excess(self, residual: FloatArray) -> float:
        """Return what the flagged groups hold above the noise: sum of squares over the noise's mean square."""
        if not self.flagged.any():
            return 0.0
        over = (self.mean_square(residual) - 1.0) * self.count
        return float(np.sum(over[self.flagged]))

    @property
    def total(self) -> float:
        """Number of all residuals."""
        return float(self.count.sum())


def groups_of(design: Design) -> Groups:
    """Group the lines of a design's residual and find those that stand out."""
    n = len(design.residual)
    rows, records = [], []
    offset = 0
    for number, item in enumerate(design.spectra):
        lines = len(item.frequencies_hz)
        own = np.arange(lines) // LINES_OF_A_GROUP
        own = np.minimum(own, max(lines // LINES_OF_A_GROUP - 1, 0))
        rows.append(np.concatenate([own, own]) + offset)
        offset += int(own.max()) + 1
        records.append(np.full(int(own.max()) + 1, number))
    one = np.concatenate(rows)
    index = one[None, :] + offset * np.arange(n)[:, None]
    count = np.bincount(index.ravel()).astype(np.float64)
    storey = np.repeat(np.arange(n), offset)
    record = np.tile(np.concatenate(records), n)
    sums = np.bincount(index.ravel(), weights=(design.residual**2).ravel()) / count
    scale = np.ones(n)
    limit = stats.chi2.isf(FLAG_P / len(count), count) / count
    # weights reckon with white noise: a tenth more is forgiven
    flagged = sums / scale[storey] > 1.1 * limit
    return Groups(index, count, scale, storey, flagged, record)
