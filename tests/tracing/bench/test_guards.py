"""Guards against false names: cross-validation, tests left out, ties."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrpipe.fitting.recordings import record_tests
from mrpipe.tracing.bench.noise.baseline import declared_base, fit_baseline
from mrpipe.tracing.bench.residuals.crossvalidation import gain_of, left_out_residual
from mrpipe.tracing.bench.selection.select import EffectCandidate
from mrpipe.tracing.bench.verdict.naming import tied_effects
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.options import NamingRules
from tests.tracing.bench.sines import harmed, scaled, sines


@pytest.mark.property
def test_a_gain_whose_interval_holds_zero_is_not_significant() -> None:
    assert Gain(0.1, (0.02, 0.18)).significant
    assert not Gain(0.1, (-0.02, 0.18)).significant
    assert not Gain(-0.1, (-0.2, -0.02)).significant


def blocks(tests: int = 4, samples: int = 400) -> Any:
    recordings = SimpleNamespace(blocks=lambda _: np.arange(tests * samples) // 40)
    return SimpleNamespace(recordings=recordings)


@pytest.mark.property
def test_a_gain_in_one_block_alone_is_not_significant() -> None:
    rng = np.random.default_rng(0)
    before = rng.standard_normal(1600)
    after = before.copy()
    after[:40] = 0.0
    assert not gain_of(before, after, blocks(), draws=200, rng=rng).significant
    assert gain_of(before, 0.9 * before, blocks(), draws=200, rng=rng).significant


@pytest.mark.planted
def test_a_test_that_is_left_out_is_not_seen() -> None:
    tests = [test for test in harmed(sines(), (3,), lambda test: scaled(test, 1.5)) if test.role == "training"]
    recordings = record_tests(tests, rate_hz=125.0)
    found = fit_baseline(recordings, declared_base(recordings, "bouc-wen", 1, 0)).fit
    unseen = left_out_residual(found, 3)
    own = recordings.used & (recordings.test == 3) & (unseen != 0.0)
    assert np.count_nonzero(own) > 50
    # the fit that has seen the stronger test follows it in part
    assert np.mean(unseen[own] ** 2) > 1.3 * np.mean(found.residual[own] ** 2)


def candidate(name: str, residual: np.ndarray) -> EffectCandidate:
    chi_square = float(np.mean(residual**2))
    found = SimpleNamespace(chi_square=chi_square, residual=residual, problem=blocks())
    return EffectCandidate(name, cast(Any, found), 0.9, {})


@pytest.mark.property
def test_rivals_that_leave_as_much_are_tied_and_others_are_not() -> None:
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(1600)
    field = (candidate("stribeck", 1.05 * noise), candidate("migration", 1.06 * noise), candidate("inertia", 2 * noise))
    assert tied_effects(field, 1.0, NamingRules(), draws=100, rng=rng) == ("migration",)
    assert tied_effects(field[::2], 1.0, NamingRules(), draws=100, rng=rng) == ()
