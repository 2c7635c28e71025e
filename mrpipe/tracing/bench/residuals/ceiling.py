"""The recoverable part of a residual: boosted trees on lagged states, judged on samples left out of the training."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.residuals.crossvalidation import folds_of
from mrpipe.tracing.bench.residuals.residual_structure import states_of

LAGS = (0.015, 0.045, 0.15, 0.45)
"""Numerical technique: lags of the states that the flexible model reads, in periods of the median training test."""

MOST_ROWS = 15_000
"""Numerical technique: largest number of samples that the flexible model is trained on."""

PIECES = 8
"""Numerical technique: pieces of a validation record; each is predicted by a model that was trained without it."""

PARTS = 4
"""Numerical technique: parts of the cross-fitting: pieces 0, 4, then 1, 5, ... are left out together."""

DRAWS = 200
"""Numerical technique: draws of the bootstrap over pieces."""


@dataclass(frozen=True)
class Ceiling:
    """Residual of a flexible model that was trained on a part of every validation record.

    Attributes
    ----------
    recordings
        Validation tests.
    measured
        Measured force without offset [N], shape (n,).
    error
        Measured minus predicted force [N] of pieces left out, shape (n,).
    piece
        Index of the piece of each sample, shape (n,).
    """

    recordings: Recordings
    measured: FloatArray
    error: FloatArray
    piece: IntArray

    def nrmse(self, part: BoolArray, rng: np.random.Generator) -> tuple[float, tuple[float, float]]:
        """Return the NRMSE over some samples, shape (n,), and its 95 % interval by bootstrap over the pieces."""
        part = part & self.recordings.used
        if not part.any():
            return 0.0, (0.0, 0.0)
        index = np.unique(self.piece[part], return_inverse=True)[1]
        squares = np.bincount(index, weights=self.error[part] ** 2)
        powers = np.bincount(index, weights=self.measured[part] ** 2)
        chosen = rng.integers(len(squares), size=(DRAWS, len(squares)))
        draws = squares[chosen].sum(axis=1) / np.maximum(powers[chosen].sum(axis=1), 1e-300)
        low, high = np.sqrt(np.quantile(draws, [0.025, 0.975]))
        return float(np.sqrt(squares.sum() / max(powers.sum(), 1e-300))), (float(low), float(high))


def cross_fitted(
    found: Fit, training: Recordings, residual: FloatArray, validation: Recordings, measured: FloatArray,
    simulated: FloatArray, *, iterations: int = 60,
) -> Ceiling:  # fmt: skip
    """Return the residual of a flexible model on pieces of the validation records that were left out of its training.

    The model is trained on the training tests and on the other pieces of the same record: first a gain, a lag and an
    offset of that record, then trees on the simulated states. Unlike a model of the training tests alone, it can
    therefore represent every validation condition.

    Parameters
    ----------
    found
        The fit whose simulated states are the inputs of the trees.
    training
        Training tests.
    residual
        Measured minus simulated force of the training tests [N], shape (n,); 0 at samples that are not compared.
    validation, measured, simulated
        Validation tests, their offset-free force and the simulated one [N], shape (m,).
    iterations
        Number of trees.
    """
    piece = _pieces(validation)
    states = np.column_stack([lagged_states(found, validation), 1.0 + validation.test])
    known = np.column_stack([lagged_states(found, training), np.zeros(len(residual))])
    rows_known = _rows(training.used)
    columns = _record_columns(validation, simulated)
    target = measured - simulated
    plain, left = target.copy(), target.copy()
    for part in range(PARTS):
        out = piece % PARTS == part
        rest = _without_record_fit(validation, columns, target, ~out)
        rows = _rows(validation.used & ~out)
        judged = np.flatnonzero(validation.used & out)
        if not len(rows) or not len(judged):
            continue
        trees = _trees(iterations)
        with threadpool_limits(1):
            trees.fit(
                np.concatenate([states[rows], known[rows_known]]), np.concatenate([rest[rows], residual[rows_known]])
            )
        plain[judged] = rest[judged]
        left[judged] = rest[judged] - trees.predict(states[judged])
    for test in range(validation.tests):
        own = validation.test == test
        # if the residual has no structure, a flexible model increases the error
        options = (target[own], plain[own], left[own])
        left[own] = min(options, key=lambda item: float(item @ item))
    return Ceiling(validation, measured, left, piece)


def _record_columns(recordings: Recordings, simulated: FloatArray) -> FloatArray:
    """Return force, rate of the force, and one, each scaled to about 1: regressors of gain, lag and offset."""
    rate = np.zeros(len(simulated))
    for test in range(recordings.tests):
        own = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        rate[own] = np.gradient(simulated[own], recordings.dt[test])
    columns = np.column_stack([simulated, rate, np.ones(len(simulated))])
    return np.asarray(columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-12))


def _without_record_fit(recordings: Recordings, columns: FloatArray, target: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the target minus a linear fit of each record to its samples that are not left out."""
    rest = target.copy()
    for test in range(recordings.tests):
        inside = recordings.test == test
        rows = inside & recordings.used & seen
        if np.count_nonzero(rows) > columns.shape[1]:
            rest[inside] -= columns[inside] @ np.linalg.lstsq(columns[rows], target[rows], rcond=1e-9)[0]
    return rest


def _pieces(recordings: Recordings) -> IntArray:
    within = np.arange(len(recordings.force)) - recordings.starts[recordings.test]
    length = np.diff(recordings.starts)[recordings.test]
    return np.asarray(recordings.test * PIECES + within * PIECES // length, dtype=np.int64)


def lagged_states(found: Fit, recordings: Recordings) -> FloatArray:
    """Return states of the simulated damper and their past, shape (n, features), without the measured force."""
    values = states_of(found, recordings).values
    columns = [values[name] for name in values if name != "direction"]
    # the lags are the same times in all tests, because delays of a rig do not depend on the motion
    period = float(np.median(found.problem.recordings.motion_period_s))
    for lag in LAGS:
        shift = np.round(lag * period / recordings.dt).astype(np.int64)[recordings.test]
        index = np.maximum(np.arange(len(recordings.force)) - shift, recordings.starts[recordings.test])
        columns += [recordings.displacement[index], recordings.velocity[index], recordings.drive[index]]
    return np.column_stack(columns)


def flexible_residual(
    found: Fit,
    training: Recordings,
    residual: FloatArray,
    validation: Recordings,
    *,
    iterations: int = 100,
) -> FloatArray:
    """Return the prediction on validation tests of a flexible model that is fitted to the training residual [N].

    Parameters
    ----------
    found
        The fit whose residual it is; its simulated states are the inputs of the trees.
    training
        Training tests.
    residual
        Residual force of the training tests [N], shape (n,); 0 at samples that are not compared.
    validation
        Validation tests.
    iterations
        Number of trees.

    Returns
    -------
    Shape (m,) [N].
    """
    rows = _rows(training.used)
    trees = _trees(iterations)
    with threadpool_limits(1):
        trees.fit(lagged_states(found, training)[rows], residual[rows])
    return np.asarray(trees.predict(lagged_states(found, validation)), dtype=np.float64)


def _rows(used: BoolArray) -> IntArray:
    rows = np.flatnonzero(used)
    return np.asarray(rows[:: max(1, -(-len(rows) // MOST_ROWS))], dtype=np.int64)


def _trees(iterations: int) -> HistGradientBoostingRegressor:
    """Return untrained trees; with at most `2 MOST_ROWS` samples and no early stopping they draw no random number."""
    return HistGradientBoostingRegressor(
        max_iter=iterations,
        learning_rate=0.08,
        max_leaf_nodes=24,
        min_samples_leaf=60,
        l2_regularization=1.0,
        random_state=0,
        early_stopping=False,
    )


def flexible_chi_square(found: Fit, *, folds: int = 3, iterations: int = 80) -> float:
    """Return the mean square of the weighted residual [1] that a flexible model leaves on tests left out of its fit."""
    problem = found.problem
    used = problem.root_weight > 0.0
    features, target = lagged_states(found, problem.recordings), found.residual
    total = 0.0
    for part in folds_of(problem.recordings, folds):
        out = np.isin(problem.recordings.test, part)
        rows = _rows(used & ~out)
        judged = np.flatnonzero(used & out)
        if not len(rows) or not len(judged):
            total += float(np.sum(target[judged] ** 2))
            continue
        trees = _trees(iterations)
        with threadpool_limits(1):
            trees.fit(features[rows], target[rows])
        total += float(np.sum((target[judged] - trees.predict(features[judged])) ** 2))
    return total / max(int(np.count_nonzero(used)), 1)
