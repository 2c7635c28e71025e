"""Motion from displacement and acceleration: gain, delay, noise, and the error of the velocity."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.signals.fusion import SensorAgreement, fused_displacement, on_displacement_clock, sensor_agreement

RATE = 1000.0
NOISE_X, NOISE_A = 5e-6, 0.2
GAIN, LATE_SAMPLES = 1.3, 3


def motion(rng: np.random.Generator, seconds: float = 20.0) -> tuple[FloatArray, FloatArray]:
    """Return displacement and acceleration of a random motion of 1 to 40 Hz, which begins and ends at rest."""
    count = round(seconds * RATE)
    band = signal.butter(3, [1.0, 40.0], "band", fs=RATE, output="sos")
    x = 0.01 * signal.sosfilt(band, rng.standard_normal(count)) * signal.windows.tukey(count, 0.1)
    omega = 2 * np.pi * np.fft.rfftfreq(count, 1 / RATE)
    return x, np.fft.irfft(-(omega**2) * np.fft.rfft(x), count)


def recorded(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the true displacement, and displacement and acceleration of two sensors, of which the first is late."""
    x, a = motion(rng)
    true = np.roll(x, LATE_SAMPLES)
    measured = true + NOISE_X * rng.standard_normal(x.size)
    return true, measured, GAIN * a + NOISE_A * rng.standard_normal(x.size) + 0.5


def velocity_error(displacement: FloatArray, true: FloatArray) -> float:
    error = np.gradient(displacement - true, 1 / RATE)
    return float(np.sqrt(np.mean(error[500:-500] ** 2)))


@pytest.mark.planted
def test_gain_delay_and_noise_are_found() -> None:
    rng = np.random.default_rng(3)
    pairs = [recorded(rng)[1:] for _ in range(2)]
    found = sensor_agreement(pairs, RATE)
    assert found.gain == pytest.approx(GAIN, rel=2e-3)
    assert found.displacement_late_s == pytest.approx(LATE_SAMPLES / RATE, abs=2e-5)
    expected = np.sqrt(NOISE_A / GAIN / NOISE_X) / (2 * np.pi)
    assert found.crossover_hz == pytest.approx(expected, rel=0.1)
    assert "3.00 ms later" in found.line


@pytest.mark.planted
def test_velocity_is_better_than_that_of_either_sensor_alone() -> None:
    true, x, a = recorded(np.random.default_rng(4))
    found = sensor_agreement([(x, a)], RATE)
    fused = fused_displacement(x, on_displacement_clock(a, found, RATE), RATE, found.crossover_hz)
    assert velocity_error(fused, true) < 0.2 * velocity_error(x, true)
    # a low-pass removes the noise of the displacement, but also a part of the motion
    low_passed = [signal.sosfiltfilt(signal.butter(2, f, fs=RATE, output="sos"), x) for f in (20, 40, 60, 80, 120, 200)]
    assert velocity_error(fused, true) < 0.7 * min(velocity_error(item, true) for item in low_passed)


@pytest.mark.planted
def test_different_frequency_responses_are_not_taken_for_noise() -> None:
    _, x, a = recorded(np.random.default_rng(5))
    # an accelerometer whose response falls by 10 % towards 100 Hz
    slow = signal.sosfiltfilt(signal.butter(1, 300.0, fs=RATE, output="sos"), a)
    plain, found = (sensor_agreement([(x, item)], RATE) for item in (a, slow))
    assert found.crossover_hz == pytest.approx(plain.crossover_hz, rel=0.4)


@pytest.mark.oracle
def test_banded_equations_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(6)
    x, a = rng.standard_normal(40), 50.0 * rng.standard_normal(40)
    crossover = 7.0
    weight = (1.0 / (2 * np.pi * crossover)) ** 2
    second = np.diff(np.eye(40), 2, axis=0) * RATE**2
    smooth = (a[:-2] + 10 * a[1:-1] + a[2:]) / 12
    rows, right = np.vstack([np.eye(40), weight * second]), np.concatenate([x, weight * smooth])
    expected = np.linalg.lstsq(rows, right, rcond=None)[0]
    assert fused_displacement(x, a, RATE, crossover) == pytest.approx(expected, rel=1e-6, abs=1e-6)


@pytest.mark.property
def test_exact_sensors_are_not_changed() -> None:
    x, a = motion(np.random.default_rng(7))
    fused = fused_displacement(x, a, RATE, 5.0)
    # the second difference has an error of fourth order in the sampling interval
    assert np.max(np.abs(fused - x)) < 1e-3 * np.std(x)


@pytest.mark.property
def test_offset_of_the_accelerometer_changes_only_the_ends() -> None:
    x, a = motion(np.random.default_rng(8))
    with_offset, without = (fused_displacement(x, a + offset, RATE, 5.0) for offset in (1.0, 0.0))
    assert np.max(np.abs(with_offset - without)[1000:-1000]) < 1e-3 * np.max(np.abs(with_offset - without))


@pytest.mark.planted
def test_one_sine_does_not_give_a_delay_of_another_period() -> None:
    rng = np.random.default_rng(9)
    t = np.arange(10_000) / RATE
    omega = 2 * np.pi * 60.0
    x = 1e-3 * np.sin(omega * (t - 0.002)) + 1e-7 * rng.standard_normal(t.size)
    a = -(omega**2) * 1e-3 * np.sin(omega * t) + 0.1 * rng.standard_normal(t.size)
    assert sensor_agreement([(x, a)], RATE).displacement_late_s == pytest.approx(0.002, abs=5e-5)


@pytest.mark.property
def test_sensors_of_different_motions_are_refused() -> None:
    rng = np.random.default_rng(10)
    x, _ = motion(rng)
    with pytest.raises(UserError, match="coherence") as caught:
        sensor_agreement([(x, rng.standard_normal(x.size))], RATE)
    assert "prepare.motion" in str(caught.value)


@pytest.mark.property
def test_clock_of_the_displacement_is_kept() -> None:
    a = np.sin(2 * np.pi * 2.0 * np.arange(1000) / RATE)
    moved = on_displacement_clock(a, SensorAgreement(2.0, 0.01, 10.0), RATE)
    assert moved[100:900] == pytest.approx(0.5 * a[90:890], abs=1e-6)


@pytest.mark.property
def test_accelerometer_of_the_opposite_direction_is_refused() -> None:
    _, x, a = recorded(np.random.default_rng(11))
    with pytest.raises(UserError, match="phases do not agree"):
        sensor_agreement([(x, -a)], RATE)


@pytest.mark.property
def test_tests_that_are_too_short_are_refused() -> None:
    """A campaign of one short test ended with a traceback."""
    rng = np.random.default_rng(12)
    x, a = rng.standard_normal((2, 30))
    with pytest.raises(UserError, match="too short to compare"):
        sensor_agreement([(x, a)], RATE)


@pytest.mark.property
def test_a_dead_accelerometer_is_refused() -> None:
    x, _ = motion(np.random.default_rng(13))
    with pytest.raises(UserError, match="is displacement-and-acceleration, but"):
        sensor_agreement([(x, np.full(x.size, 0.2))], RATE)
