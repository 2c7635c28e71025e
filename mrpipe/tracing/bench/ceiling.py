"""How much of a residual is recoverable at all: boosted trees on lagged states, judged on tests they never saw."""

from __future__ import annotations

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.crossvalidation import folds_of
from mrpipe.tracing.bench.residual_structure import states_of

LAGS_S = (0.01, 0.03, 0.1, 0.3)
MOST_ROWS = 15_000


def lagged_states(found: Fit, recordings: Recordings) -> FloatArray:
    """Return states of the simulated damper and their past, shape (n, features); no measured force among them."""
    values = states_of(found, recordings).values
    columns = [values[name] for name in values if name != "direction"]
    for lag in LAGS_S:
        shift = np.round(lag / recordings.dt).astype(np.int64)[recordings.test]
        index = np.maximum(np.arange(len(recordings.force)) - shift, recordings.starts[recordings.test])
        columns += [recordings.displacement[index], recordings.velocity[index], recordings.drive[index]]
    return np.column_stack(columns)


def flexible_residual(
    found: Fit,
    training: Recordings,
    residual: FloatArray,
    validation: Recordings,
    *,
    seed: int = 0,
    iterations: int = 100,
) -> FloatArray:
    """Return what a flexible model, fitted to the residual [N] of the training tests, predicts on the validation tests.

    Parameters
    ----------
    found
        The fit whose residual it is; its simulated states are what the trees see.
    residual
        Residual force of the training tests [N], shape (n,), 0 where not compared.

    Returns
    -------
    Shape (m,) [N].
    """
    rows = _rows(training.used)
    trees = _trees(seed, iterations)
    with threadpool_limits(1):
        trees.fit(lagged_states(found, training)[rows], residual[rows])
    return np.asarray(trees.predict(lagged_states(found, validation)), dtype=np.float64)


def _rows(used: BoolArray) -> IntArray:
    rows = np.flatnonzero(used)
    return np.asarray(rows[:: max(1, -(-len(rows) // MOST_ROWS))], dtype=np.int64)


def _trees(seed: int, iterations: int) -> HistGradientBoostingRegressor:
    return HistGradientBoostingRegressor(
        max_iter=iterations,
        learning_rate=0.08,
        max_leaf_nodes=24,
        min_samples_leaf=60,
        l2_regularization=1.0,
        random_state=seed,
        early_stopping=False,
    )


def flexible_chi_square(found: Fit, *, folds: int = 3, seed: int = 0, iterations: int = 80) -> float:
    """Return the mean square that a flexible model leaves of a fit's weighted residual, on whole tests left out."""
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
        trees = _trees(seed, iterations)
        with threadpool_limits(1):
            trees.fit(features[rows], target[rows])
        total += float(np.sum((target[judged] - trees.predict(features[judged])) ** 2))
    return total / max(int(np.count_nonzero(used)), 1)
