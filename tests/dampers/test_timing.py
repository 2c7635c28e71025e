"""Motion at other instants than those of its samples: against scipy's cubic and a motion that is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.timing import look_ahead


def swing(time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    omega = 20.0
    return 0.01 * np.sin(omega * time), 0.01 * omega * np.cos(omega * time), -0.01 * omega**2 * np.sin(omega * time)


@pytest.mark.property
@given(ahead=st.floats(-0.03, 0.03))
def test_motion_is_that_of_the_other_instant(ahead: float) -> None:
    # two tests of unlike rates end to end
    first, second = np.arange(500) * 1e-3, np.arange(300) * 2e-3
    motion = [np.concatenate(pair) for pair in zip(swing(first), swing(second), strict=True)]
    x, v, a = look_ahead(*motion, np.array([0, 500, 800]), np.array([1e-3, 2e-3]), ahead)
    for piece, time in ((slice(0, 500), first), (slice(500, 800), second)):
        inside = (time + ahead >= time[0]) & (time + ahead < time[-1])
        exact = swing(time[inside] + ahead)
        np.testing.assert_allclose(x[piece][inside], exact[0], atol=1e-8)
        np.testing.assert_allclose(v[piece][inside], exact[1], atol=1e-4)
        np.testing.assert_allclose(a[piece][inside], exact[2], atol=3e-3)


@pytest.mark.oracle
def test_displacement_is_the_cubic_through_values_and_velocities() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(40) * 0.01
    x, v = rng.normal(size=40), rng.normal(size=40)
    moved, _, _ = look_ahead(x, v, np.zeros(40), np.array([0, 40]), np.array([0.01]), 0.0234)
    expected = CubicHermiteSpline(time, x, v)(time + 0.0234)
    np.testing.assert_allclose(moved[:37], expected[:37], atol=1e-12)


@pytest.mark.property
def test_beyond_the_record_the_motion_goes_on_evenly() -> None:
    time = np.arange(100) * 0.01
    x, v, _ = look_ahead(time**2, 2.0 * time, np.full(100, 2.0), np.array([0, 100]), np.array([0.01]), 0.05)
    assert x[-1] == pytest.approx(0.99**2 + 0.05 * 1.98)
    assert v[-1] == pytest.approx(1.98)
