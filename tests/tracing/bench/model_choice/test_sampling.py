"""Models are fitted faster where the force changes between two samples, and only there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from scipy.signal import cont2discrete, lfilter

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
FILTER_DAMPING = 0.8


@cache
def _training(planted: str) -> tuple[PreparedTest, ...]:
    return tuple(test for test in campaign(planted) if test.role != "validation")


def _fit(planted: str, *effects: tuple[str, str]) -> Fit:
    return _fit_to(_training(planted), *effects)


def _fit_to(tests: tuple[PreparedTest, ...], *effects: tuple[str, str]) -> Fit:
    recordings = record_tests(tests, rate_hz=SLOW_HZ)
    found = fit_baseline(recordings, declared_base(recordings, "bouc-wen", 2, 1)).fit
    library = damper_effects()
    problem = replace(
        found.problem, terms=tuple(Term(library[name], library[name].form(item)) for name, item in effects)
    )
    return fit(problem, start_of(problem, found.base_values, [{} for _ in effects]), iterations=15)


def _filtered(test: PreparedTest) -> PreparedTest:
    """Return a test whose force went through a low-pass of second order that delays slow changes by 4 ms."""
    omega = 2.0 * FILTER_DAMPING / 4e-3
    continuous = ([omega**2], [1.0, 2.0 * FILTER_DAMPING * omega, omega**2])
    numerator, denominator, _ = cont2discrete(continuous, test.dt, method="bilinear")
    force = lfilter(numerator[0], denominator, test.force_raw_n)
    return replace(test, force_n=force, force_raw_n=force)


def test_a_filter_whose_input_turns_between_two_samples_is_fitted_faster() -> None:
    tests = tuple(_filtered(test) for test in _training("none"))
    found = _fit_to(tests, ("channel-skew", "filtered-force"))
    rate = better_rate(found, tests, rate_hz=SLOW_HZ, gain=0.1)
    assert 2.0 * SLOW_HZ <= rate < tests[0].sampling_rate_hz


def test_play_needs_no_higher_rate() -> None:
    """The places where the flanks meet between two samples are exact at any rate."""
    found = _fit("wide-backlash", ("backlash", "held"))
    assert better_rate(found, _training("wide-backlash"), rate_hz=SLOW_HZ, gain=0.1) == SLOW_HZ


def test_a_slow_force_keeps_the_rate() -> None:
    found = _fit("accumulator", ("accumulator", "linear"))
    assert better_rate(found, _training("accumulator"), rate_hz=250.0, gain=0.1) == 250.0


def test_a_record_has_no_higher_rate_than_its_own() -> None:
    found = _fit("wide-backlash", ("backlash", "held"))
    tests = _training("wide-backlash")
    assert better_rate(found, tests, rate_hz=tests[0].sampling_rate_hz, gain=0.1) == tests[0].sampling_rate_hz
