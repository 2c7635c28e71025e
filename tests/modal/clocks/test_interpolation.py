"""A record between its samples: amplitudes of motion with few samples a period survive."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mrpipe.modal.clocks.interpolation import between_samples


@pytest.mark.property
@pytest.mark.parametrize("share", [0.002, 0.05, 0.2, 0.3, 0.4, 0.45])
def test_a_sine_keeps_its_amplitude_between_samples(share):
    rate = 50.0
    time = np.arange(3000) / rate
    wanted = time[100:-100] + 0.37 / rate
    found = between_samples(np.sin(2.0 * np.pi * share * rate * time + 0.3), rate)(wanted)
    assert found == pytest.approx(np.sin(2.0 * np.pi * share * rate * wanted + 0.3), abs=2e-3)
    if share >= 0.3:
        # the spline through the samples, as it was before
        spline = CubicSpline(time, np.sin(2.0 * np.pi * share * rate * time + 0.3))(wanted)
        assert np.abs(spline - found).max() > 0.03


@pytest.mark.property
def test_samples_and_ends_stay():
    rng = np.random.default_rng(1)
    for size in (2, 30, 500):
        values = np.cumsum(rng.standard_normal(size))
        found = between_samples(values, 20.0)(np.arange(size) / 20.0)
        assert found == pytest.approx(values, abs=2e-3 * np.ptp(values) + 1e-12)
