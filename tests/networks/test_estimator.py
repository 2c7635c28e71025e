"""The network as an estimator of scikit-learn: its own checks, cloning, searching, and the training of the stages."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.utils.estimator_checks import check_estimator

from mrpipe.api.rows import network_rows
from mrpipe.networks.estimator import NetworkRegressor
from mrpipe.networks.network import FeatureSpec
from mrpipe.signals.prepared import PreparedTest

SMALL = {"hidden": (4,), "starts": 1, "subsample_iterations": 25, "iterations": 0, "random_state": 1}


def curve(rows: int = 300) -> tuple[np.ndarray, np.ndarray]:
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (rows, 2))
    return X, 80.0 * np.tanh(3.0 * X[:, 0]) + 20.0 * X[:, 1]


@pytest.mark.oracle
def test_scikit_learn_accepts_the_estimator() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_estimator(NetworkRegressor(**SMALL), on_skip=None)


@pytest.mark.planted
def test_a_saturating_force_is_learned_and_scored() -> None:
    X, y = curve()
    model = NetworkRegressor(**{**SMALL, "subsample_iterations": 80}).fit(X[:200], y[:200])
    assert model.score(X[200:], y[200:]) > 0.999
    assert model.network_.architecture == "2-4-1"
    np.testing.assert_array_equal(model.predict(X), model.network_.predict(X))


@pytest.mark.property
def test_a_clone_with_the_same_seed_gives_the_same_network() -> None:
    X, y = curve(120)
    first = NetworkRegressor(**SMALL).fit(X, y)
    second = clone(first)
    assert not hasattr(second, "network_") and second.get_params() == first.get_params()
    np.testing.assert_array_equal(second.fit(X, y).predict(X), first.predict(X))


@pytest.mark.property
def test_architectures_are_searched_over_whole_tests() -> None:
    X, y = curve(240)
    groups = np.repeat(np.arange(12), 20)
    search = GridSearchCV(NetworkRegressor(**SMALL), {"hidden": [(1,), (5,)]}, cv=GroupKFold(3))
    search.fit(X, y, groups=groups)
    assert search.best_params_["hidden"] == (5,)
    with pytest.raises(ValueError, match="groups"):
        NetworkRegressor(**SMALL).fit(X, y, groups=groups[:-1])


@pytest.mark.planted
def test_rows_of_prepared_tests_carry_their_meaning() -> None:
    t = np.arange(0.0, 4.0, 1e-3)
    tests = []
    for number, drive in enumerate((0.0, 1.0, 2.0, 0.5, 1.5, 0.8)):
        v = 0.1 * np.cos(2.0 * np.pi * 2.0 * t)
        x = 0.1 / (2.0 * np.pi * 2.0) * np.sin(2.0 * np.pi * 2.0 * t)
        force = (30.0 + 40.0 * drive) * np.tanh(v / 0.04)
        tests.append(
            PreparedTest(
                name=f"t{number}", role="training", time_s=t, displacement_m=x, velocity_m_s=v,
                acceleration_m_s2=np.gradient(v, t), drive=np.full_like(t, drive), force_n=force,
                sampling_rate_hz=1000.0, displacement_raw_m=x, force_raw_n=force, cycles=np.arange(0, 4000, 500),
                drive_unit="A",
            )
        )  # fmt: skip
    X, y, groups, spec = network_rows(tests, past_values=2)
    assert spec == FeatureSpec(("velocity", "drive"), 2, False, 200.0, "force")
    assert X.shape == (len(y), 6) and set(groups) == set(range(6))
    model = NetworkRegressor(**{**SMALL, "hidden": (6,), "subsample_iterations": 60, "features": spec})
    assert model.fit(X, y, groups).score(X, y) > 0.99
    assert model.network_.features == spec
    with pytest.raises(ValueError, match="columns"):
        clone(model).fit(X[:, :3], y)
