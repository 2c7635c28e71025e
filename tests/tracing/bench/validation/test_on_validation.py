"""Errors on the validation tests, and what noise explains of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.fitting.recordings import Recordings, record_tests
from mrpipe.tracing.bench.noise.baseline import Baseline, declared_base, fit_baseline
from mrpipe.tracing.bench.validation.on_validation import OnValidation, on_validation
from mrpipe.tracing.rules import ValidationRules
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted
RULES = ValidationRules()


def recorded(effect: str, validation: bool) -> Recordings:
    tests = [test for test in campaign(effect) if (test.role == "validation") == validation]
    return record_tests(tests, rate_hz=250.0)


def baseline_of(effect: str) -> Baseline:
    training = recorded(effect, False)
    return fit_baseline(training, declared_base(training, "bouc-wen", 2, 1))


@pytest.fixture(scope="module")
def baseline() -> Baseline:
    return baseline_of("")


@pytest.fixture(scope="module", params=["", "accumulator"])
def found(request: pytest.FixtureRequest) -> tuple[str, OnValidation]:
    base = baseline_of(request.param)
    training, validation = base.fit.problem.recordings, recorded(request.param, True)
    return request.param, on_validation(base.fit, base.fit, base, training, validation, RULES)


def test_the_error_is_that_of_the_prediction(found: tuple[str, OnValidation]) -> None:
    effect, judged = found
    assert judged.nrmse(judged.before) == pytest.approx(judged.score_before.nrmse, rel=1e-9)
    assert judged.nrmse(judged.after) == judged.nrmse(judged.before)
    assert (judged.nrmse(judged.after) > 0.05) == (effect == "accumulator")


def test_noise_explains_no_more_than_the_error(found: tuple[str, OnValidation]) -> None:
    effect, judged = found
    assert judged.floor_nrmse() <= judged.nrmse(judged.after) * 1.0001
    remains, share, _ = judged.unexplained(RULES)
    assert remains == (effect == "accumulator")
    assert share > 0.9 if effect == "accumulator" else judged.floor_nrmse() > 0.7 * judged.nrmse(judged.after)


def test_what_the_offset_of_a_test_is_estimated_from_is_not_judged(baseline: Baseline) -> None:
    training, validation = baseline.fit.problem.recordings, recorded("", True)
    judged = on_validation(baseline.fit, baseline.fit, baseline, training, validation, RULES, own_offsets=True)
    assert np.count_nonzero(judged.recordings.used) < np.count_nonzero(judged.recorded.used)
    assert not np.any(judged.recordings.used & ~judged.recorded.used)


def test_a_wrong_force_is_an_error_of_its_size(found: tuple[str, OnValidation]) -> None:
    judged = found[1]
    wrong = replace(judged, after=1.1 * judged.measured)
    assert wrong.nrmse(wrong.after) == pytest.approx(0.1, rel=1e-6)
