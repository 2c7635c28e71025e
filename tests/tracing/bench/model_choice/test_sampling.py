"""Models are fitted faster where the force changes between two samples, and only there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.model_choice.sampling import better_rate
from mrpipe.tracing.bench.noise.baseline import declared_base, fit_baseline
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted

SLOW_HZ = 62.5


@cache
def _training(planted: str) -> tuple[PreparedTest, ...]:
    return tuple(test for test in campaign(planted) if test.role != "validation")


def _fit(planted: str, *effects: tuple[str, str]) -> Fit:
    recordings = record_tests(_training(planted), rate_hz=SLOW_HZ)
    found = fit_baseline(recordings, declared_base(recordings, "bouc-wen", 2, 1)).fit
    library = damper_effects()
    problem = replace(
        found.problem, terms=tuple(Term(library[name], library[name].form(item)) for name, item in effects)
    )
    return fit(problem, start_of(problem, found.base_values, [{} for _ in effects]), iterations=15)


def test_the_end_of_play_between_two_samples_is_fitted_faster() -> None:
    found = _fit("wide-backlash", ("backlash", "held"))
    # four times the rate leaves only a little less than twice the rate
    assert better_rate(found, _training("wide-backlash"), rate_hz=SLOW_HZ, gain=0.1) == 2.0 * SLOW_HZ


def test_a_slow_force_keeps_the_rate() -> None:
    found = _fit("accumulator", ("accumulator", "linear"))
    assert better_rate(found, _training("accumulator"), rate_hz=250.0, gain=0.1) == 250.0


def test_a_record_has_no_higher_rate_than_its_own() -> None:
    found = _fit("wide-backlash", ("backlash", "held"))
    tests = _training("wide-backlash")
    assert better_rate(found, tests, rate_hz=tests[0].sampling_rate_hz, gain=0.1) == tests[0].sampling_rate_hz
