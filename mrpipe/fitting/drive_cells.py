"""Sums over the samples of each test and level of drive, to which laws of the drive are fitted."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.dampers.laws import LawShape
from mrpipe.fitting.engine import Fit, centred, regressors, weighting
from mrpipe.fitting.kernel import CURRENT_AT, run_recordings
from mrpipe.fitting.start import LEVEL_SHARE, drive_varies, mean_levels

BINS = 8
"""A drive that varies is sorted into so many levels."""

CELLS = 32
"""Within each of which the law is taken as constant over so many parts of the whole range."""


@dataclass(frozen=True)
class Cells:
    """Sums over the samples of each test and drive.

    Attributes
    ----------
    drive
        Mean effective drive over the limit, shape (k,).
    level
        Level of drive that each belongs to, shape (k,).
    gram, right, power
        Products of the signals of yield force and viscosity, with the force, and of the force with itself; shapes
        (k, 2, 2), (k, 2), (k,).
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
    """Return the sums that laws are fitted to, from a fit of any form."""
    problem = found.problem
    flat = LawShape("polynomial", 0)
    base = replace(problem.base, laws=(flat,) * len(problem.base.laws))
    plain = replace(problem, base=base, reference=found.laws)
    w = weighting(problem)
    columns = centred(regressors(plain, found.theta)[:, w.at], w)[0]
    force = centred(problem.recordings.force[w.at][None], w)[0][0]
    own = regressors(problem, found.theta)[:, w.at]
    own = centred(own, w)[0]
    # what is neither yield force nor viscosity stays as the fit has it
    first = sum(law.count for law in problem.base.laws[:2])
    force = force - found.linear[first:] @ own[first:]
    current = run_recordings(found.chain(), problem.recordings)[CURRENT_AT][w.at]
    limit = problem.scales.drive
    test = problem.recordings.test[w.at]
    share = current / limit
    if drive_varies(problem.recordings):
        part = np.clip((share * CELLS).astype(np.int64), 0, CELLS - 1)
        level = part * BINS // CELLS
    else:
        level = levels_of_tests(mean_levels(problem.recordings), limit)[test]
        part = level
    key = np.unique(test * (CELLS + 1) + part, return_inverse=True)[1]
    signals = columns[:2]
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
