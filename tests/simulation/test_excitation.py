"""Base motions: random motion has the RMS value, the centre and the width that were asked for."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.simulation.excitation import Excitation, harmonic, narrow_band

OMEGA, WIDTH, RMS = 8.0, 0.1, 0.5


def motion(seed: int, duration_s: float = 4000.0) -> Excitation:
    return narrow_band(RMS, OMEGA, WIDTH, np.random.default_rng(seed), duration_s=duration_s, settling_s=10.0)


@pytest.mark.property
def test_random_motion_has_its_rms_centre_and_width() -> None:
    t = np.arange(0.0, 4000.0, 0.05)
    record = motion(1).at(t)
    assert np.sqrt(np.mean(record**2)) == pytest.approx(RMS, rel=0.01)
    power = np.abs(np.fft.rfft(record)) ** 2
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(t), 0.05)
    # the power within half a width of the centre is half of that of a resonant filter
    near = np.abs(omega / OMEGA - 1.0) < 0.5 * WIDTH
    assert power[near].sum() / power.sum() == pytest.approx(0.5, abs=0.05)
    assert omega[near][np.argmax(np.convolve(power[near], np.ones(200), "same"))] == pytest.approx(OMEGA, rel=0.04)
    # Gaussian: its kurtosis is 3
    assert np.mean(record**4) / np.mean(record**2) ** 2 == pytest.approx(3.0, abs=0.5)


@pytest.mark.property
def test_random_motion_is_that_of_its_seed_and_starts_softly() -> None:
    t = np.linspace(0.0, 30.0, 301)
    assert np.array_equal(motion(1, 60.0).at(t), motion(1, 60.0).at(t))
    assert not np.allclose(motion(1, 60.0).at(t), motion(2, 60.0).at(t))
    eased = narrow_band(RMS, OMEGA, WIDTH, np.random.default_rng(1), duration_s=60.0, ramp_s=2.0)
    assert eased.at(np.zeros(1))[0] == 0.0
    assert eased.details["base_amplitude_m_s2"] == pytest.approx(np.sqrt(2.0) * RMS)
    assert motion(1, 60.0).steady_s == (10.0, 60.0)


@pytest.mark.property
def test_harmonic_motion_starts_at_its_phase() -> None:
    t = np.linspace(10.0, 12.0, 50)
    motion = harmonic(RMS, OMEGA, cycles=20, settling_cycles=10, phase_rad=0.7)
    np.testing.assert_allclose(motion.at(t), -RMS * np.sin(OMEGA * t + 0.7), atol=1e-12)
