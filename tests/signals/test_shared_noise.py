"""Noise that all tests share is seen where a test holds no motion, and motion is freed of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import signal

from mrpipe.fitting.recordings import record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.signals.shared_noise import NoiseDensity, quiet_motion, shared_noise

pytestmark = pytest.mark.property

RATE = 1000.0
SECONDS = 6.0
TIME = np.arange(int(SECONDS * RATE)) / RATE
NOISE_M = 5e-6
COLOUR = signal.butter(1, 20.0, fs=RATE, output="sos")


def triangle(frequency_hz: float) -> np.ndarray:
    """Return a triangle of 10 mm that begins within its cycle."""
    return 0.01 * signal.sawtooth(2.0 * np.pi * frequency_hz * TIME + 1.0, 0.5)


def sine(frequency_hz: float) -> np.ndarray:
    """Return a sine of 10 mm that begins within its cycle."""
    return 0.01 * np.sin(2.0 * np.pi * frequency_hz * TIME + 0.4)


def random_motion(highest_hz: float, seed: int) -> np.ndarray:
    """Return random motion of 10 mm with power up to a frequency."""
    sos = signal.butter(6, highest_hz, fs=RATE, output="sos")
    values = signal.sosfiltfilt(sos, np.random.default_rng(seed).standard_normal(len(TIME)))
    return 0.01 * values / float(np.max(np.abs(values)))


MOTIONS = [*map(sine, (0.5, 1.0, 1.5, 2.0)), triangle(0.7), triangle(1.1), random_motion(6.0, 1), random_motion(9.0, 2)]


def white(rng: np.random.Generator) -> np.ndarray:
    """Return white noise of 5 micrometres."""
    return NOISE_M * rng.standard_normal(len(TIME))


def coloured(rng: np.random.Generator) -> np.ndarray:
    """Return noise of 5 micrometres that falls above 20 Hz."""
    values = signal.sosfilt(COLOUR, rng.standard_normal(len(TIME)))
    return np.asarray(NOISE_M * values / np.std(values))


def hum(rng: np.random.Generator) -> np.ndarray:
    """Return white noise of 5 micrometres with hum of the mains of 7 micrometres."""
    return white(rng) + 1e-5 * np.sin(2.0 * np.pi * 50.0 * TIME + rng.uniform(0.0, 6.0))


def recorded(noise: Callable[[np.random.Generator], np.ndarray], motions: list[np.ndarray]) -> list[PreparedTest]:
    """Return tests of given motions [m] with the noise of one sensor."""
    rng = np.random.default_rng(3)
    tests = []
    for number, x in enumerate(motions):
        v = np.gradient(x, 1.0 / RATE)
        tests.append(
            PreparedTest(
                f"{number}", "training", RATE, TIME, x, v, np.gradient(v, 1.0 / RATE), np.ones_like(x), v,
                x + noise(rng), v, np.array([], dtype=np.int64), "A",
            )
        )  # fmt: skip
    return tests


def density_of(tests: list[PreparedTest]) -> NoiseDensity:
    """Return the noise density, which these tests show."""
    found = shared_noise(tests)
    assert found is not None
    return found


def velocity_errors(tests: list[PreparedTest]) -> np.ndarray:
    """Return the RMS error of the velocity of each test [m/s], without the ends."""
    recordings = record_tests(tests, rate_hz=RATE)
    inner = slice(300, -300)
    errors = []
    for number, test in enumerate(tests):
        own = slice(int(recordings.starts[number]), int(recordings.starts[number + 1]))
        errors.append(float(np.std((recordings.velocity[own] - test.velocity_m_s)[inner])))
    return np.array(errors)


def test_the_density_of_white_noise_is_found_next_to_the_motion() -> None:
    found = density_of(recorded(white, MOTIONS))
    assert np.median(found.density) == pytest.approx(NOISE_M**2 / (RATE / 2.0), rel=0.1)
    middle = found.density[(found.frequency_hz > 3.0) & (found.frequency_hz < 400.0)]
    assert np.quantile(middle, [0.05, 0.95]) == pytest.approx(np.median(middle), rel=0.4)


def test_the_density_of_coloured_noise_falls_as_it_does() -> None:
    found = density_of(recorded(coloured, MOTIONS))
    low, high = (float(np.median(found.at(np.arange(*band)))) for band in ((15.0, 25.0), (180.0, 220.0)))
    _, gain = signal.sosfreqz(COLOUR, [20.0, 200.0], fs=RATE)
    assert low / high == pytest.approx(float(np.abs(gain[0] / gain[1]) ** 2), rel=0.3)


def test_hum_counts_as_noise() -> None:
    found = density_of(recorded(hum, MOTIONS))
    assert found.at(np.array([50.0]))[0] > 20.0 * found.at(np.array([60.0]))[0]


def test_harmonics_that_all_tests_share_are_no_noise() -> None:
    """A machine distorts every sine in the same way (labcontrol: motion of 40 micrometres was taken for noise)."""
    distorted = [a * (sine(1.0) + sum(sine(k * 1.0) / (60.0 * k) for k in (5, 7, 9))) for a in (0.4, 0.6, 0.8, 1.0)]
    tests = recorded(white, distorted)
    for test in quiet_motion(tests, density_of(tests)):
        assert np.std((test.displacement_raw_m - test.displacement_m)[300:-300]) < 2.0 * test.displacement_noise_m


@pytest.mark.parametrize(("noise", "most"), [(white, 1.0), (coloured, 0.2), (hum, 0.2)])
def test_the_velocity_is_better_than_behind_a_low_pass(
    noise: Callable[[np.random.Generator], np.ndarray], most: float
) -> None:
    """A low-pass by criterion takes noise for white: it lets coloured noise and hum pass."""
    tests = recorded(noise, MOTIONS)
    quiet = quiet_motion(tests, density_of(tests))
    # the corners of triangles are lost in every filter
    filtered, estimated = (np.delete(velocity_errors(some), [4, 5]) for some in (tests, quiet))
    assert np.sqrt(np.mean(estimated**2)) < most * np.sqrt(np.mean(filtered**2))
    # a few thousandths of the speed
    assert np.all(estimated < 4e-3 * 0.06)


def test_the_noise_that_remains_is_stated() -> None:
    tests = recorded(white, MOTIONS[:4])
    for test in quiet_motion(tests, density_of(tests)):
        error = test.displacement_raw_m - test.displacement_m
        assert test.displacement_noise_m == pytest.approx(np.std(error[300:-300]), rel=0.6)
        assert test.motion_band_hz < 25.0


def test_the_harmonics_of_triangles_pass() -> None:
    tests = recorded(white, [*map(sine, (0.5, 1.0, 1.5, 2.0)), *map(triangle, (0.5, 0.7, 1.0, 1.3))])
    for test in quiet_motion(tests, density_of(tests))[4:]:
        assert test.motion_band_hz > 30.0
        assert np.std((test.displacement_raw_m - test.displacement_m)[300:-300]) < 0.8 * NOISE_M


def test_motion_without_noise_is_kept() -> None:
    tests = recorded(lambda _: np.zeros(len(TIME)), MOTIONS)
    noise = density_of(recorded(white, MOTIONS))
    small = NoiseDensity(noise.frequency_hz, 1e-8 * noise.density)
    for test in quiet_motion(tests, small):
        assert np.std((test.displacement_raw_m - test.displacement_m)[300:-300]) < 1e-6


def test_a_test_without_motion_is_returned_as_it_is() -> None:
    still = recorded(lambda _: np.zeros(len(TIME)), [np.zeros(len(TIME))])
    assert shared_noise(still) is None
    noise = density_of(recorded(white, MOTIONS))
    assert quiet_motion(still, noise) == still
