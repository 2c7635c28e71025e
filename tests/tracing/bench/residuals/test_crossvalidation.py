"""Tests are left out so that the others still hold every drive level; intervals count whole tests."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy import stats

from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.residuals.crossvalidation import _jackknife, folds_of, intervals, samples_seen_by
from tests.tracing.bench.fits import plain_fit


@pytest.mark.property
@pytest.mark.parametrize("folds", [2, 3])
def test_no_fold_takes_a_drive_level_away(folds: int) -> None:
    """A campaign of three frequencies at 0, 1, 2 A in turn: every third test is one level."""
    levels = np.tile([0.0, 1.0, 2.0], 3)
    recordings = cast(
        Any,
        SimpleNamespace(
            tests=9,
            test=np.repeat(np.arange(9), 50),
            drive=np.repeat(levels, 50),
            displacement=np.tile(np.sin(np.linspace(0, 6, 50)), 9),
        ),
    )
    parts = folds_of(recordings, folds)
    assert sorted(index for part in parts for index in part) == list(range(9))
    for part in parts:
        assert {levels[index] for index in range(9) if index not in part} == {0.0, 1.0, 2.0}


@pytest.mark.property
def test_what_a_fold_has_not_seen_is_not_held_against_an_effect() -> None:
    def recordings(stroke: float, drive: float) -> Any:
        wave = np.sin(np.linspace(0.0, 6.28, 400))
        return SimpleNamespace(force=wave, displacement=stroke * wave, velocity=0.1 * wave, drive=np.full(400, drive))

    inside = samples_seen_by(recordings(8e-3, 1.0), recordings(1e-2, 1.0))
    assert np.array_equal(inside, np.abs(recordings(1e-2, 1.0).displacement) <= 8e-3 * 1.02)
    assert samples_seen_by(recordings(1e-2, 1.0), recordings(8e-3, 1.0)).all()
    assert not samples_seen_by(recordings(1e-2, 1.0), recordings(8e-3, 2.0)).any()


def _regression(rng: np.random.Generator, tests: int = 12, samples: int = 40) -> tuple[np.ndarray, ...]:
    """Return regressors, target and test numbers; the slope of each test departs from 3 and from -1."""
    test = np.repeat(np.arange(tests), samples)
    rows = rng.standard_normal((2, len(test))) * rng.uniform(0.5, 2.0, (2, tests))[:, test]
    slopes = np.array([[3.0], [-1.0]]) + 0.3 * rng.standard_normal((2, tests))
    return rows, np.sum(slopes[:, test] * rows, axis=0) + 0.1 * rng.standard_normal(len(test)), test


@pytest.mark.oracle
def test_the_jackknife_is_that_of_fits_without_each_test() -> None:
    rows, target, test = _regression(np.random.default_rng(2))
    solution = np.linalg.lstsq(rows.T, target, rcond=None)[0]
    found, count = _jackknife(rows, target - solution @ rows, test)
    without = [np.linalg.lstsq(rows[:, test != k].T, target[test != k], rcond=None)[0] for k in range(12)]
    assert count == 12
    np.testing.assert_allclose(found, np.sqrt(11.0) * np.std(without, axis=0), rtol=1e-9)


@pytest.mark.property
def test_intervals_hold_the_truth_although_errors_persist_within_a_test() -> None:
    rng = np.random.default_rng(3)
    inside = []
    for _ in range(200):
        rows, target, test = _regression(rng)
        solution = np.linalg.lstsq(rows.T, target, rcond=None)[0]
        deviation, count = _jackknife(rows, target - solution @ rows, test)
        inside.append(np.abs(solution - [3.0, -1.0]) < stats.t.ppf(0.975, count - 1) * deviation)
    assert np.all(np.mean(inside, axis=0) > 0.91)


@pytest.mark.planted
def test_an_interval_counts_the_error_of_the_model() -> None:
    plain = plain_fit("accumulator")
    effect = damper_effects()["accumulator"]
    problem = replace(plain.problem, terms=(Term(effect, effect.form("linear")),))
    found = fit(problem, start_of(problem, plain.base_values, [{"stiffness": 0.0}]))
    ((name, (low, high)),) = intervals(found)[0].items()
    # the true spring hardens on one side: 1400 N/m (1 + 4 x)
    assert name == "stiffness"
    assert low < 1400.0 < high
    assert high - low < 0.2 * 1400.0
