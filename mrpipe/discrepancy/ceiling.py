"""How much of a residual is recoverable at all: boosted trees on lagged states, judged on tests they never saw."""

from __future__ import annotations

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor

from mrpipe.artifacts import FloatArray
from mrpipe.discrepancy.engine import Fit
from mrpipe.discrepancy.recordings import Recordings
from mrpipe.discrepancy.structure import states_of

LAGS_S = (0.01, 0.03, 0.1, 0.3)
MOST_ROWS = 20_000


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
    iterations: int = 150,
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
    rows = np.flatnonzero(training.used)
    rows = rows[:: max(1, -(-len(rows) // MOST_ROWS))]
    trees = HistGradientBoostingRegressor(
        max_iter=iterations,
        learning_rate=0.08,
        max_leaf_nodes=24,
        min_samples_leaf=60,
        l2_regularization=1.0,
        random_state=seed,
        early_stopping=False,
    )
    trees.fit(lagged_states(found, training)[rows], residual[rows])
    return np.asarray(trees.predict(lagged_states(found, validation)), dtype=np.float64)
