"""Where a residual stands out of the noise: groups of lines, and shares over those that do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.tracing.structure.fit import Design, stacked

LINES_OF_A_GROUP = 24

OF_RESPONSE, OF_FLOOR, LEAST_OF_RESPONSE = 0.01, 0.2, 0.002
"""What stands out matters where it is, in some record, this share of a storey's force; or raises what noise leaves
there by the second share, and is at least the third of the force: below it lie errors of clocks and gains."""

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
    record
        Record of each group, shape (g,).
    response
        Sum of squares of the weighted force of each group, shape (g,).
    """

    index: IntArray
    count: FloatArray
    scale: FloatArray
    storey: IntArray
    flagged: BoolArray
    record: IntArray
    response: FloatArray

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

    def over(self, residual: FloatArray) -> FloatArray:
        """Return what each flagged group holds above the noise, none below nought, shape (g,)."""
        return np.where(self.flagged, np.maximum((self.mean_square(residual) - 1.0) * self.count, 0.0), 0.0)

    def material(self, residual: FloatArray) -> bool:
        """Return whether what stands out matters beside the force of some storey in some record."""
        place = self.record * (int(self.storey.max()) + 1) + self.storey
        over, response, count = (
            np.bincount(place, weights=w) for w in (self.over(residual), self.response, self.count)
        )
        share = np.sqrt(over / np.maximum(response, 1e-300))
        raised = np.sqrt(1.0 + over / np.maximum(count, 1.0)) - 1.0
        return bool(np.any((share > OF_RESPONSE) | ((raised > OF_FLOOR) & (share > LEAST_OF_RESPONSE))))


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
    target = np.concatenate([stacked(item.target * item.weight) for item in design.spectra], axis=1)
    response = np.asarray(np.bincount(index.ravel(), weights=(target**2).ravel()), dtype=np.float64)
    return Groups(index, count, scale, storey, flagged, record, response)
