"""The noise floor holds what the channels show, and noise in the band of the motion that only repetition shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from mrpipe.fitting.recordings import record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.baseline import declared_base, fit_baseline
from mrpipe.tracing.bench.weights import (
    _factors,
    _parts_of_differences,
    _robust_factors,
    sensor_deviation,
)
from mrpipe.tracing.rules import NoiseRules
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


@pytest.mark.property
@pytest.mark.parametrize("events", [0.0, 0.1])
def test_events_that_do_not_repeat_are_no_noise(events: float) -> None:
    """A tenth of all differences is 30 times as large as the noise, so the mean square is 90 times too large."""
    rng = np.random.default_rng(5)
    columns = np.stack([np.ones(8000), np.where(np.arange(8000) % 10 == 0, 4.0, 0.01)], axis=1)
    difference = np.sqrt(columns @ [3.0, 5.0]) * rng.standard_normal(8000)
    difference[rng.random(8000) < events] *= 30.0
    factors, limited = _robust_factors(columns, difference**2, np.zeros(8000))
    assert (np.sum(limited) < 0.5 * np.sum(difference**2)) == (events > 0.0)
    # with a tenth of events the limited mean settles 1.65 times above that of the noise
    assert factors == pytest.approx(np.array([3.0, 5.0]) * (1.0 if events == 0.0 else 1.65), rel=0.15)
    if events == 0.0:
        assert _factors(columns, difference**2, 1.0) == pytest.approx([3.0, 5.0], rel=0.1)


@pytest.mark.property
@pytest.mark.parametrize("amplitude", [0.0, 10.0])
def test_a_disturbance_that_grows_with_the_speed_is_no_noise(amplitude: float) -> None:
    """The disturbance has a frequency that the motion does not have, so that cycles differ by it."""
    rng = np.random.default_rng(6)
    time = np.arange(8000) / 500.0
    speed = np.sqrt(2.0) * np.abs(np.cos(2.0 * np.pi * 0.9 * time))
    columns = np.stack([np.ones(8000), np.where(speed < 0.1, 4.0, 0.01), speed], axis=1)
    noise = np.sqrt(columns[:, :2] @ [3.0, 5.0]) * rng.standard_normal(8000)
    disturbance = amplitude * speed * np.sin(2.0 * np.pi * 7.3 * time)
    factors, without, disturbed = _parts_of_differences(
        columns, (noise + disturbance) ** 2, np.zeros(8000), NoiseRules()
    )
    if amplitude == 0.0:
        assert not disturbed.any()
        assert factors == pytest.approx([3.0, 5.0], rel=0.1)
    else:
        assert np.mean(disturbed) == pytest.approx(np.mean(disturbance**2), rel=0.25)
        assert np.mean(without) == pytest.approx(np.mean(noise**2) + np.mean(disturbance**2), rel=0.05)
        # without the third part the noise of the force would be 17 times as large as it is
        assert factors[0] < 0.25 * float(np.mean(without))
