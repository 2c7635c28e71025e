"""Noise and step of a channel are found from the channel alone."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.signals.channel_noise import displacement_cutoff, motion_frequency, resolution, steady_noise

pytestmark = pytest.mark.property

RATE = 1000.0
TIME = np.arange(20_000) / RATE


def test_the_step_of_a_quantised_channel() -> None:
    smooth = np.sin(np.linspace(0.0, 30.0, 4000))
    assert resolution(smooth) == 0.0
    assert resolution(np.round(smooth / 0.02) * 0.02) == pytest.approx(0.02)


def test_corners_of_a_force_are_not_taken_for_noise() -> None:
    """A force of friction jumps at every reversal: ten jumps of 100 N above noise of 0.3 N."""
    noise = 0.3 * np.random.default_rng(3).standard_normal(len(TIME))
    force = 50.0 * np.sign(np.sin(2.0 * np.pi * 0.25 * TIME)) + noise
    assert steady_noise(force, RATE) == pytest.approx(0.3, rel=0.15)


def test_the_cut_off_lies_between_the_motion_and_the_noise() -> None:
    motion = 0.01 * np.sin(2.0 * np.pi * 2.0 * TIME)
    noise = 2e-6 * np.random.default_rng(4).standard_normal(len(TIME))
    frequency = motion_frequency(motion, np.gradient(motion, 1.0 / RATE))
    assert frequency == pytest.approx(2.0, rel=1e-3)
    assert 8.0 * frequency <= displacement_cutoff(motion + noise, RATE, frequency) < 0.25 * RATE


@pytest.mark.property
@pytest.mark.parametrize("levels", [50, 5000])
def test_fine_steps_of_a_converter_are_found(levels: int) -> None:
    """Of 5000 levels nearly every one of 1500 samples has its own; third differences of a ramp are often zero."""
    time = np.arange(1500) / 500.0
    step = 2.0 / levels
    exact = np.interp(np.mod(time, 0.6973), [0.0, 0.34865, 0.6973], [-1.0, 1.0, -1.0])
    recorded = np.round(exact / step) * step * 1e3 / 1e3 + 0.0137
    assert resolution(recorded) == pytest.approx(step, rel=1e-6)
    assert steady_noise(recorded, 500.0) >= 0.99 * step / np.sqrt(12.0)
    assert resolution(exact + 1e-4 * np.random.default_rng(0).standard_normal(1500)) == 0.0
