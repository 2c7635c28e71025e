"""Hum of the mains is found in what a model leaves, although cycles repeat it; harmonics of the motion are not hum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.fitting.recordings import Recordings, record_tests
from mrpipe.tracing.bench.noise.hum import hum_variance
from mrpipe.tracing.rules import NoiseRules
from tests.fitting.test_recordings import sine

pytestmark = pytest.mark.property

RATE = 500.0


@pytest.fixture(scope="module")
def recordings() -> Recordings:
    """Tests with periods of 20 ms times a whole number, so that hum repeats from cycle to cycle."""
    tests = [sine(f"{hz}", hz, seconds=4.0) for hz in (0.5, 1.0, 2.0, 2.5)]
    found = record_tests(tests, rate_hz=RATE)
    return replace(found, used=np.ones(len(found.force), dtype=np.bool_))


def _noise(recordings: Recordings) -> np.ndarray:
    return np.random.default_rng(4).standard_normal(len(recordings.force))


@pytest.mark.parametrize("mains_hz", [50.0, 60.0])
def test_its_variance_is_found(recordings: Recordings, mains_hz: float) -> None:
    phase = recordings.test + 2.0 * np.pi * mains_hz * recordings.time
    assert hum_variance(_noise(recordings) + 3.0 * np.sin(phase), recordings, NoiseRules()) == pytest.approx(
        4.5, rel=0.1
    )


def test_noise_has_none(recordings: Recordings) -> None:
    assert hum_variance(_noise(recordings), recordings, NoiseRules()) == 0.0


def test_harmonics_of_the_motion_are_none(recordings: Recordings) -> None:
    # a triangle at the frequency of each motion has lines at 50 Hz, as at all its other harmonics
    hertz = np.array([0.5, 1.0, 2.0, 2.5])[recordings.test]
    corners = 200.0 * np.abs((hertz * recordings.time) % 1.0 - 0.5) ** 0.5
    assert hum_variance(0.1 * _noise(recordings) + corners, recordings, NoiseRules()) == 0.0


def test_a_line_of_one_test_is_none(recordings: Recordings) -> None:
    once = np.where(recordings.test == 1, 5.0 * np.sin(2.0 * np.pi * 50.0 * recordings.time), 0.0)
    assert hum_variance(_noise(recordings) + once, recordings, NoiseRules()) == 0.0
