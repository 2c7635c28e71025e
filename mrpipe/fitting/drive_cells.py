"""Sums over the samples of each test and level of drive. The laws of the drive are fitted to these sums."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.dampers.laws import LawShape
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.kernel import CURRENT_AT, run_recordings
from mrpipe.fitting.solution import regressors
from mrpipe.fitting.start import LEVEL_SHARE, drive_varies, mean_levels
from mrpipe.fitting.weighting import centred, weighting

BINS = 8
"""Number of levels into which a varying drive is sorted."""

CELLS = 128
"""Number of parts of the whole range of the drive, within each of which a law is taken as constant."""


@dataclass(frozen=True)
class Cells:
    """Sums over the samples of each cell: one test at one part of the range of the drive.

    Attributes
    ----------
    drive
        Mean effective drive of each cell over the limit, shape (k,).
    level
        Level of drive of each cell, shape (k,).
    gram, right, power
        Sums of the products of the two signals (of yield force and viscosity) with each other, with the force, and of
        the squared force; shapes (k, 2, 2), (k, 2), (k,).
    limit
        Largest drive [A or V].
    """

    drive: FloatArray
    level: IntArray
    gram: FloatArray
    right: FloatArray
    power: FloatArray
    limit: float

    @property
    def levels(self) -> int:
        """Number of levels."""
        return int(self.level.max()) + 1


def cells_of(found: Fit) -> Cells:
    """Return the sums that laws are fitted to, from a fit of any form.

    The offset of a test is one number for all of its cells. At constant drive a test has one cell, and the means are
    subtracted. If the drive varies, the mean of a law times a signal is not the law times the mean of the signal. The
    fitted offset is then subtracted from the force instead.
    """
    problem = found.problem
    flat = LawShape("polynomial", 0)
    base = replace(problem.base, laws=(flat,) * len(problem.base.laws))
    plain = replace(problem, base=base, reference=found.laws)
    w = weighting(problem)
    signals = regressors(plain, found.theta)[:2]
    own = regressors(problem, found.theta)
    # the parts other than yield force and viscosity keep their fitted values
    first = sum(law.count for law in problem.base.laws[:2])
    recordings, test = problem.recordings, problem.recordings.test[w.at]
    force = recordings.force - found.test_offsets[recordings.test] - found.linear[first:] @ own[first:]
    share = run_recordings(found.chain(), problem.recordings)[CURRENT_AT][w.at] / problem.scales.drive
    if drive_varies(problem.recordings):
        part = np.clip((share * CELLS).astype(np.int64), 0, CELLS - 1)
        level = part * BINS // CELLS
    else:
        level = levels_of_tests(mean_levels(problem.recordings), problem.scales.drive)[test]
        part = level
    key = np.unique(test * (CELLS + 1) + part, return_inverse=True)[1]
    rows = np.vstack([signals, force])
    constant = _one_cell(test, key)
    rows = np.where(constant, centred(rows, w)[0], rows[:, w.at] * w.root)
    return _sums(key, share, level, rows[:2], rows[2], problem.scales.drive)


def _one_cell(test: IntArray, key: IntArray) -> BoolArray:
    """Return whether each sample belongs to a test with only one cell, shape (n,)."""
    pairs = np.unique(np.stack([test, key]), axis=1)
    return np.asarray(np.bincount(pairs[0])[test] == 1)


def _sums(
    key: IntArray, share: FloatArray, level: IntArray, signals: FloatArray, force: FloatArray, limit: float
) -> Cells:
    """Return the sums over the samples of each cell `key`; signals have shape (2, n)."""
    count = int(key.max()) + 1
    size = np.bincount(key)
    gram = np.empty((count, 2, 2))
    for a, b in itertools.product(range(2), range(2)):
        gram[:, a, b] = np.bincount(key, weights=signals[a] * signals[b])
    right = np.stack([np.bincount(key, weights=signal * force) for signal in signals], axis=1)
    _, level = np.unique(level, return_inverse=True)
    return Cells(
        np.bincount(key, weights=share) / size,
        np.round(np.bincount(key, weights=level) / size).astype(np.int64),
        gram,
        np.asarray(right, dtype=np.float64),
        np.asarray(np.bincount(key, weights=force**2), dtype=np.float64),
        limit,
    )


def levels_of_tests(means: FloatArray, limit: float) -> IntArray:
    """Return the level of drive of each test from its mean drive, shape (tests,)."""
    order = np.argsort(means, kind="stable")
    steps = np.diff(means[order], prepend=means[order[0]]) > LEVEL_SHARE * limit
    found = np.empty(len(means), dtype=np.int64)
    found[order] = np.cumsum(steps)
    return found
