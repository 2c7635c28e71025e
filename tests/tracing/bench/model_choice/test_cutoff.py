"""The displacement is freed of noise as far as models predict better, and no further."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy import signal

from mrpipe.dampers.library import base_form
from mrpipe.fitting.engine import fit
from mrpipe.fitting.recordings import record_tests
from mrpipe.fitting.start import base_of, best_fit, first_problem, polynomial_laws
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.model_choice.cutoff import (
    MotionFilter,
    best_filter,
    better_filter,
    loosest_limit,
    simple_error,
)
from tests.tracing.bench.rig import hysteresis

RATE = 1000.0
SECONDS = 6.0


def sine(amplitude_m: float, frequency_hz: float) -> np.ndarray:
    """Return a sine."""
    return amplitude_m * np.sin(2.0 * np.pi * frequency_hz * np.arange(int(SECONDS * RATE)) / RATE)


def random_motion(amplitude_m: float, highest_hz: float, seed: int) -> np.ndarray:
    """Return random motion with power up to a frequency."""
    sos = signal.butter(6, highest_hz, fs=RATE, output="sos")
    values = signal.sosfiltfilt(sos, np.random.default_rng(seed).standard_normal(int(SECONDS * RATE)))
    return amplitude_m * values / float(np.max(np.abs(values)))


def recorded(motions: list[np.ndarray], law: str, hum_m: float = 0.0) -> list[PreparedTest]:
    """Return tests of a damper without effects; 1 micrometre and 0.3 N of noise, and hum of the mains in the motion."""
    rng = np.random.default_rng(5)
    tests = []
    for number, x in enumerate(motions):
        time = np.arange(len(x)) / RATE
        v = np.gradient(x, 1.0 / RATE)
        current = float(1 + number % 3)
        z = np.tanh(v / 0.01) if law == "velocity" else hysteresis(x, 2e-4)
        force = 60.0 * current * z + 200.0 * v + 0.3 * rng.standard_normal(len(x))
        hum = hum_m * sum(np.sin(2.0 * np.pi * line * time + line) for line in (50.0, 100.0, 150.0))
        measured = x + 1e-6 * rng.standard_normal(len(x)) + hum
        a, drive = np.gradient(v, 1.0 / RATE), np.full_like(x, current)
        tests.append(
            PreparedTest(
                f"{number}", "training", RATE, time, x, v, a, drive, force, measured, force,
                np.array([], dtype=np.int64), "A", "periodic",
            )
        )  # fmt: skip
    return tests


def filter_of(tests: list[PreparedTest]) -> MotionFilter:
    automatic = record_tests(tests, rate_hz=250.0)
    return best_filter(tests, automatic, partial(simple_error, rate_hz=250.0, yield_order=2, viscosity_order=1))


@pytest.mark.planted
def test_hum_that_all_tests_share_is_removed() -> None:
    motions = [sine(0.01 * size, speed) for size in (0.5, 1.0) for speed in (0.5, 1.0, 1.5)]
    tests = recorded(motions, "velocity", hum_m=1e-6)
    found = filter_of(tests)
    assert np.max(record_tests(tests, rate_hz=250.0).cutoff_hz) > 150.0
    assert found.noise is not None
    for test in found.applied(tests):
        assert np.std((test.displacement_raw_m - test.displacement_m)[500:-500]) < 3e-7


@pytest.mark.planted
def test_no_noise_is_estimated_from_the_spectra_where_the_sensors_give_it() -> None:
    motions = [sine(0.01 * size, speed) for size in (0.5, 1.0) for speed in (0.5, 1.0, 1.5)]
    tests = recorded(motions, "velocity", hum_m=1e-6)
    known = [replace(test, displacement_noise_m=1e-6, displacement_noise_band_hz=10.0) for test in tests]
    assert filter_of(known).noise is None


@pytest.mark.planted
def test_hum_is_filtered_where_the_noise_is_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    # a spectrum cannot separate the lines of the mains from motion; the force by velocity shows that they are none
    monkeypatch.setattr("mrpipe.tracing.bench.model_choice.cutoff.shared_noise", lambda _: None)
    motions = [sine(0.01 * size, speed) for size in (0.5, 1.0) for speed in (0.5, 1.0, 1.5)]
    found = filter_of(recorded(motions, "velocity", hum_m=1e-6))
    assert found.noise is None
    assert found.limit_hz < 50.0


@pytest.mark.planted
@pytest.mark.parametrize("bands_hz", [(60.0, 60.0, 30.0, 15.0), (40.0, 40.0, 40.0, 40.0)])
def test_motion_that_the_hysteresis_follows_is_kept(bands_hz: tuple[float, ...]) -> None:
    """Where all tests hold the same random motion, that motion looks like noise of the sensor."""
    tests = recorded([random_motion(0.002, highest, seed) for seed, highest in enumerate(bands_hz)], "hysteresis")
    found = filter_of(tests)
    recordings = record_tests(found.applied(tests), rate_hz=1000.0, highest_cutoff_hz=found.limit_hz)
    moved = np.concatenate([test.displacement_m for test in tests])
    error = (recordings.displacement - moved)[recordings.used]
    assert np.sqrt(np.mean(error**2)) < 2e-6


@pytest.mark.property
def test_a_limit_lowers_only_the_cut_offs_above_it() -> None:
    tests = recorded([random_motion(0.002, 60.0, 1), sine(0.01, 0.5)], "velocity")
    automatic, limited = (record_tests(tests, rate_hz=250.0, highest_cutoff_hz=value) for value in (np.inf, 40.0))
    np.testing.assert_allclose(limited.cutoff_hz, np.minimum(automatic.cutoff_hz, 40.0))


@pytest.mark.planted
def test_the_chosen_model_finds_that_a_limit_rounds_the_corners_of_triangles() -> None:
    time = np.arange(int(SECONDS * RATE)) / RATE
    motions = [0.006 * signal.sawtooth(2.0 * np.pi * speed * time, 0.5) for speed in (0.6, 0.8, 1.0, 1.2)]
    tests = recorded(motions, "hysteresis")
    automatic, low = (record_tests(tests, rate_hz=250.0, highest_cutoff_hz=limit) for limit in (np.inf, 6.0))
    form = base_form("bouc-wen")
    found = best_fit(first_problem(low, base_of(low, form, polynomial_laws(form, 3, 2, 1))), starts=1, iterations=6)
    better = better_filter(found, tests, automatic, MotionFilter(6.0), rate_hz=250.0)
    assert better.noise is not None or better.limit_hz > 20.0
    # where nothing is lost, the filter is kept
    present = MotionFilter()
    problem = replace(found.problem, recordings=automatic, root_weight=automatic.used / found.problem.scales.force)
    assert better_filter(fit(problem, found.theta), tests, automatic, present, rate_hz=250.0) is present


@pytest.mark.planted
@pytest.mark.parametrize(("hum_m", "needed"), [(0.0, False), (2e-5, True)])
def test_validation_tests_are_filtered_no_more_than_the_chosen_model_needs(hum_m: float, needed: bool) -> None:
    """A limit that slow training tests do not need took away a part of fast validation motion (seed 50184)."""
    motions = [sine(0.01 * size, speed) for size in (0.5, 1.0) for speed in (0.5, 0.7)]
    tests = recorded(motions, "velocity", hum_m=hum_m)
    automatic, low = (record_tests(tests, rate_hz=250.0, highest_cutoff_hz=limit) for limit in (np.inf, 8.0))
    form = base_form("bingham")
    found = best_fit(first_problem(low, base_of(low, form, polynomial_laws(form, 3, 2, 1))), starts=1, iterations=6)
    limit = loosest_limit(found, tests, automatic, 8.0, rate_hz=250.0)
    assert limit < 50.0 if needed else limit > 50.0
    assert loosest_limit(found, tests, automatic, np.inf, rate_hz=250.0) == np.inf
