"""Rounding of a displacement follows the motion near its reversals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.fitting.recordings import record_tests
from mrpipe.tracing.bench.noise.motion_noise import rounding_error
from tests.tracing.bench.noise.test_weights import sine_tests


@pytest.mark.property
@pytest.mark.parametrize("dither", [0.0, 0.15])
def test_the_error_of_rounding_is_largest_near_reversals(dither: float) -> None:
    """The true error of a low-passed quantised sine, beside white noise of the same variance."""
    rng = np.random.default_rng(8)
    test = next(test for test in sine_tests() if test.name.endswith("sine"))
    step = 2e-2 * float(np.std(test.displacement_m))
    exact = test.displacement_m
    rounded = np.round((exact + dither * step * rng.standard_normal(len(exact))) / step) * step
    recordings = record_tests([replace(test, displacement_raw_m=rounded)], rate_hz=250.0)
    truth = record_tests([replace(test, displacement_raw_m=exact)], rate_hz=250.0, cutoff_hz=recordings.cutoff_hz[0])
    assert recordings.displacement_rounding[0] == pytest.approx(step)
    error = recordings.displacement - truth.displacement
    drawn = np.array([rounding_error(recordings, 0, rng)[0] for _ in range(20)])
    slow = (np.abs(recordings.velocity) < 0.2 * np.max(np.abs(recordings.velocity))) & recordings.used
    random = rounding_error(recordings, 0, rng)[1]
    white = random * recordings.displacement_noise[0] ** 2
    assert np.sqrt(np.mean(drawn[:, slow] ** 2) + white) == pytest.approx(np.sqrt(np.mean(error[slow] ** 2)), rel=0.35)
    assert np.mean(drawn[:, slow] ** 2) + white > 1.2 * recordings.displacement_noise[0] ** 2


@pytest.mark.property
def test_a_displacement_that_is_not_quantised_has_no_error_of_rounding() -> None:
    recordings = record_tests(sine_tests()[:1], rate_hz=250.0)
    error, random = rounding_error(recordings, 0, np.random.default_rng(0))
    assert not error.any()
    assert random == 1.0
