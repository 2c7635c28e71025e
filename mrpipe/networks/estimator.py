"""Networks with the interface of scikit-learn: `fit`, `predict`, `score`, and parameters that can be searched."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, check_random_state, validate_data

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.networks.assembly import Samples
from mrpipe.networks.held_out import TrainingData
from mrpipe.networks.network import FeatureSpec, Network
from mrpipe.networks.options import InverseTrainingOptions, TrainingOptions
from mrpipe.networks.scaling import NORMALISATION, Normalisation, scaling_of
from mrpipe.networks.training import train_on

_DEFAULTS = InverseTrainingOptions()
"""Source of the defaults, so that the estimator and `train-inverse` have the same ones."""


class NetworkRegressor(RegressorMixin, BaseEstimator):
    """A feed-forward network with tanh layers, trained as `mrpipe train-forward` and `train-inverse` train.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer.
    biases
        Whether biases are trained; without biases the estimate for zero features is zero.
    starts, refined_starts, averaged
        Number of random starts, of starts that are trained further with all rows, and of networks that are averaged.
    subsample_rows, subsample_iterations, iterations
        Rows and largest number of iterations of the first phase, and iterations with all rows.
    held_out_share
        Share of the rows, or of the groups, on which training stops and starts are compared.
    weight_decay
        Penalty on the squared weights.
    normalisation
        `maximum`, `range` or `standard`, see :func:`mrpipe.networks.scaling.scaling_of`.
    features
        Meaning of the columns, which :func:`mrpipe.network_rows` returns; None: columns without a meaning.
    random_state
        Seed; the same seed and data give the same network.

    Attributes
    ----------
    network_
        The trained network; `mrpipe.networks.network.Network`.
    n_features_in_
        Number of columns.
    n_iter_
        Iterations of the chosen start.
    """

    def __init__(
        self,
        hidden: Sequence[int] = _DEFAULTS.hidden,
        *,
        biases: bool = _DEFAULTS.biases,
        starts: int = _DEFAULTS.starts,
        refined_starts: int = _DEFAULTS.refined_starts,
        averaged: int = _DEFAULTS.averaged,
        subsample_rows: int = _DEFAULTS.subsample_rows,
        subsample_iterations: int = _DEFAULTS.subsample_iterations,
        iterations: int = _DEFAULTS.iterations,
        held_out_share: float = _DEFAULTS.held_out_share,
        weight_decay: float = _DEFAULTS.weight_decay,
        normalisation: Normalisation = NORMALISATION,
        features: FeatureSpec | None = None,
        random_state: Any = None,
    ) -> None:
        self.hidden = hidden
        self.biases = biases
        self.starts = starts
        self.refined_starts = refined_starts
        self.averaged = averaged
        self.subsample_rows = subsample_rows
        self.subsample_iterations = subsample_iterations
        self.iterations = iterations
        self.held_out_share = held_out_share
        self.weight_decay = weight_decay
        self.normalisation = normalisation
        self.features = features
        self.random_state = random_state

    def fit(self, X: ArrayLike, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Train the network.

        Parameters
        ----------
        X, y
            Shapes (n, R) and (n,).
        groups
            Test of each row, shape (n,): whole tests are held out, because rows of one test resemble each other. None:
            single rows are held out.

        Raises
        ------
        ValueError
            If X or y are not finite, or their shapes do not agree with each other or with `features`.
        """
        checked = validate_data(self, X, y, dtype=np.float64, ensure_min_samples=2, y_numeric=True)
        rows: FloatArray = checked[0]
        target = np.asarray(checked[1], dtype=np.float64)
        rng = np.random.default_rng(check_random_state(self.random_state).randint(2**31))
        spec = self._spec(rows.shape[1])
        held = self._held_out(len(target), groups, rng)
        data = TrainingData(
            spec,
            _rows(rows, target, np.flatnonzero(~held)),
            _rows(rows, target, np.flatnonzero(held)),
            _rows(rows, target, np.arange(len(target))),
            scaling_of(rows, target, spec, self.normalisation),
            (),
        )
        trained = train_on(data, self._options(), rng)
        self.network_: Network = trained.network
        self.n_iter_ = trained.iterations
        return self

    def predict(self, X: ArrayLike) -> FloatArray:
        """Return the estimates, shape (n,), of rows (n, R)."""
        check_is_fitted(self)
        rows = validate_data(self, X, dtype=np.float64, reset=False)
        return self.network_.predict(rows)

    def _spec(self, width: int) -> FeatureSpec:
        if self.features is None:
            names = getattr(self, "feature_names_in_", [f"x{place}" for place in range(width)])
            return FeatureSpec(tuple(str(name) for name in names), 0, False, 1.0, "y")
        if self.features.width != width:
            raise ValueError(f"X has {width} columns, but `features` describes {self.features.width}")
        return self.features

    def _options(self) -> TrainingOptions:
        return TrainingOptions(
            architecture=tuple(self.hidden),
            biases=self.biases,
            starts=self.starts,
            refined_starts=self.refined_starts,
            averaged=self.averaged,
            subsample_rows=self.subsample_rows,
            subsample_iterations=self.subsample_iterations,
            iterations=self.iterations,
            held_out_share=self.held_out_share,
            weight_decay=self.weight_decay,
        )

    def _held_out(self, count: int, groups: ArrayLike | None, rng: np.random.Generator) -> Any:
        """Return which rows are held out, shape (n,)."""
        of_row = np.arange(count) if groups is None else np.asarray(groups)
        if of_row.shape != (count,):
            raise ValueError(f"groups has shape {of_row.shape}, but X has {count} rows")
        names = np.unique(of_row)
        number = round(self.held_out_share * len(names))
        # with so few groups, each held-out group would remove a test condition from the fit
        number = 0 if len(names) < 5 else number
        return np.isin(of_row, rng.permutation(names)[:number])


def _rows(X: FloatArray, y: FloatArray, places: IntArray) -> Samples:
    return Samples(X[places], y[places], places, np.zeros(len(places), dtype=np.int64))
