"""The noise floor holds what the channels show, and noise in the band of the motion that only repetition shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from mrpipe.fitting.recordings import record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.noise.baseline import declared_base, fit_baseline
from mrpipe.tracing.bench.noise.weights import _limit, noise_variances, sensor_deviation
from mrpipe.tracing.rules import NoiseRules
from tests.tracing.bench.fits import plain_fit
from tests.tracing.bench.rig import RATE, campaign


def coloured(corner_hz: float, deviation: float, size: int, rng: np.random.Generator) -> np.ndarray:
    """Return noise of first order with a corner frequency."""
    keep = np.exp(-2.0 * np.pi * corner_hz / RATE)
    noise = signal.lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(size + 1000))[1000:]
    return deviation * noise


def sine_tests() -> list[PreparedTest]:
    tests = [test for test in campaign("none") if test.name.endswith(("sine", "triangle")) and test.role == "training"]
    return [test for test in tests if np.ptp(test.drive) == 0.0]


@pytest.mark.planted
@pytest.mark.parametrize("corner_hz", [0.0, 10.0])
@pytest.mark.parametrize("step_n", [0.0, 6.0])
def test_the_floor_is_the_error_of_the_true_model(corner_hz: float, step_n: float) -> None:
    rng = np.random.default_rng(7)
    tests, errors = [], []
    for test in sine_tests():
        # 0.5 N of white noise and 4 micrometres are in the record already
        extra = coloured(corner_hz, 2.0, len(test.force_n), rng) if corner_hz else np.zeros(len(test.force_n))
        force = test.force_raw_n + extra
        force = np.round(force / step_n) * step_n if step_n else force
        errors.append(force - test.force_raw_n)
        tests.append(replace(test, force_n=force, force_raw_n=force))
    recordings = record_tests(tests, rate_hz=250.0)
    baseline = fit_baseline(recordings, declared_base(recordings, "bouc-wen", 2, 1))
    used = recordings.used
    deviation = sensor_deviation(baseline.fit, recordings, baseline.scale)[used]
    left = baseline.fit.residual[used] / baseline.fit.problem.root_weight[used]
    # the base form is the true one: what it leaves is noise
    assert np.sqrt(np.mean(deviation**2)) == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.25)
    assert np.sqrt(np.mean(left**2)) > 0.9 * np.sqrt(np.mean(np.concatenate(errors) ** 2))
    assert baseline.noise == pytest.approx(baseline.fit.chi_square, rel=0.5)
    assert baseline.scale.cycles > 0


@pytest.mark.planted
def test_the_floor_under_a_model_that_lacks_an_effect_is_the_noise_and_not_the_error_of_the_model() -> None:
    rng = np.random.default_rng(7)
    planted = {test.name: test for test in campaign("accumulator")}
    tests, errors = [], []
    for test in (planted[item.name] for item in sine_tests()):
        errors.append(coloured(10.0, 2.0, len(test.force_n), rng))
        force = test.force_raw_n + errors[-1]
        tests.append(replace(test, force_n=force, force_raw_n=force))
    recordings = record_tests(tests, rate_hz=250.0)
    baseline = fit_baseline(recordings, declared_base(recordings, "bouc-wen", 2, 1))
    deviation = sensor_deviation(baseline.fit, recordings, baseline.scale)[recordings.used]
    # 0.5 N of white noise is in the record already
    noise = np.hypot(np.sqrt(np.mean(np.concatenate(errors) ** 2)), 0.5)
    assert np.sqrt(np.mean(deviation**2)) == pytest.approx(noise, rel=0.1)
    assert baseline.fit.chi_square > 5.0 * baseline.noise


@pytest.mark.property
def test_noise_that_is_simulated_too_large_in_one_test_leaves_that_of_the_others() -> None:
    """One limit for all tests made the noise of all a tenth of what the others show."""
    rng = np.random.default_rng(3)
    test = np.repeat(np.arange(10), 2000)
    residual = rng.standard_normal(test.size)
    variance = np.where(test == 4, 100.0, 0.9)
    assert _limit(residual, variance, test) == pytest.approx(0.9, abs=0.03)
    assert _limit(residual, 4.0 * np.ones(test.size), test) == pytest.approx(0.25, rel=0.05)
    assert _limit(residual, 0.5 * np.ones(test.size), test) == 1.0


@pytest.mark.property
def test_the_simulated_noise_follows_from_the_seed_of_the_rules() -> None:
    found = plain_fit("none")
    recordings = found.problem.recordings
    force, motion = noise_variances(found, recordings, draws=1)
    same, other = (noise_variances(found, recordings, NoiseRules(seed=seed), draws=1)[1] for seed in (0, 1))
    np.testing.assert_array_equal(motion, same)
    assert np.any(motion != other)
    # another record of the same noise has about the same size
    assert 0.5 < np.sum(other) / np.sum(motion) < 2.0
    assert np.all(force > 0.0)
