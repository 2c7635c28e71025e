"""Groups of neighbouring spectral lines in which a residual exceeds the noise, and the share that a fit explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.fit import Design, stacked

LINES_OF_A_GROUP = 24
"""Numerical technique: number of lines of a group. A smaller group has more scatter; a larger one does not resolve the
resonances."""


@dataclass(frozen=True)
class Groups:
    """Groups of neighbouring lines of a record and storey.

    Attributes
    ----------
    index
        Index of the group of each weighted residual, shape (n, 2 b).
    count
        Number of lines of each group (real and imaginary), shape (g,).
    scale
        Mean square of the noise in the residual of each storey, shape (n,); 1 if the sensor noise is as estimated.
    storey
        Storey of each group, shape (g,).
    flagged
        Groups that exceed the noise, shape (g,).
    record
        Record of each group, shape (g,).
    response
        Sum of squares of the weighted force of each group, shape (g,).
    rules
        Decision thresholds.
    """

    index: IntArray
    count: FloatArray
    scale: FloatArray
    storey: IntArray
    flagged: BoolArray
    record: IntArray
    response: FloatArray
    rules: FrameRules = field(default_factory=FrameRules)

    def of_storeys(self, storeys: Sequence[int]) -> Groups:
        """Return the groups with only those of some storeys, from 0, flagged."""
        return replace(self, flagged=self.flagged & np.isin(self.storey, storeys))

    def mean_square(self, residual: FloatArray) -> FloatArray:
        """Return the mean square of each group divided by that of the noise, shape (g,)."""
        sums = np.bincount(self.index.ravel(), weights=(residual**2).ravel(), minlength=len(self.count))
        return np.asarray(sums / self.count / self.scale[self.storey])

    def excess(self, residual: FloatArray) -> float:
        """Return the excess of the flagged groups over the noise: sum of squares over the mean square of the noise."""
        if not self.flagged.any():
            return 0.0
        over = (self.mean_square(residual) - 1.0) * self.count
        return float(np.sum(over[self.flagged]))

    def over(self, residual: FloatArray) -> FloatArray:
        """Return the excess of each flagged group over the noise, at least 0, shape (g,)."""
        return np.where(self.flagged, np.maximum((self.mean_square(residual) - 1.0) * self.count, 0.0), 0.0)

    def material(self, residual: FloatArray) -> bool:
        """Return whether the excess matters compared with the force of some storey in some record."""
        rules = self.rules
        place = self.record * (int(self.storey.max()) + 1) + self.storey
        over, response, count = (
            np.bincount(place, weights=w) for w in (self.over(residual), self.response, self.count)
        )
        share = np.sqrt(over / np.maximum(response, 1e-300))
        raised = np.sqrt(1.0 + over / np.maximum(count, 1.0)) - 1.0
        visible = (raised > rules.of_floor) & (share > rules.least_of_response)
        return bool(np.any((share > rules.of_response) | visible))


def groups_of(design: Design, rules: FrameRules | None = None) -> Groups:
    """Group the lines of a design's residual and find the groups that exceed the noise."""
    rules = rules or FrameRules()
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
    limit = stats.chi2.isf(rules.significance / len(count), count) / count
    flagged = sums / scale[storey] > rules.coloured * limit
    target = np.concatenate([stacked(item.target * item.weight) for item in design.spectra], axis=1)
    response = np.asarray(np.bincount(index.ravel(), weights=(target**2).ravel()), dtype=np.float64)
    return Groups(index, count, scale, storey, flagged, record, response, rules)
