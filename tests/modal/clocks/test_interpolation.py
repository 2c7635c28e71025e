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


@pytest.mark.oracle
def test_values_and_slopes_are_those_of_the_spline_of_scipy():
    rng = np.random.default_rng(2)
    found = between_samples(np.cumsum(rng.standard_normal(300)), 20.0)
    # samples, instants between them, the ends, and instants outside the record
    time = np.concatenate(
        [np.arange(300) / 20.0, rng.uniform(0.0, 299.0 / 20.0, 500), [0.0, 299.0 / 20.0, -0.02, 15.0]]
    )
    value, slope = found.with_slope(time)
    np.testing.assert_allclose(value, found.spline(time), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(slope, found.spline(time, 1), rtol=1e-7, atol=1e-7)
