"""How far a motion stands out of its noise."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.signals.filters import butterworth_lowpass
from mrpipe.signals.spectra import signal_end

RATE = 1000.0


@pytest.mark.property
@pytest.mark.parametrize("frequency", [0.6, 1.0, 1.9])
def test_a_slow_sine_ends_where_it_is_and_not_where_a_short_window_smears_it(frequency: float) -> None:
    time = np.arange(4000) / RATE
    for seed in range(5):
        noise = 5e-6 * np.random.default_rng(seed).standard_normal(4000)
        assert signal_end(0.012 * np.sin(2 * np.pi * frequency * time) + noise, RATE) < 6.0


@pytest.mark.property
def test_a_wide_band_ends_where_its_power_does() -> None:
    rng = np.random.default_rng(1)
    motion = butterworth_lowpass(rng.standard_normal(8000), 60.0, RATE)
    end = signal_end(motion + 1e-3 * rng.standard_normal(8000), RATE)
    assert 60.0 < end < 350.0
    assert signal_end(rng.standard_normal(4000), RATE) < 20.0


@pytest.mark.property
def test_a_record_without_noise_has_no_end() -> None:
    time = np.arange(4000) / RATE
    steps = np.cumsum(np.sign(np.sin(2 * np.pi * 3.0 * time)))
    assert signal_end(steps, RATE) == RATE / 2.0
