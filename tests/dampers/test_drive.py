"""The lag of the drive and the polynomials of (2.3)."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lsim

from mrpipe.dampers.drive import advance_lag, driver_lag, driver_lag_apart, polynomial_coefficients
from mrpipe.dampers.plant import CURRENT, VISCOSITY, YIELD_FORCE, build_chain, run_chain
from tests.dampers.series import lag_series

numbers = st.floats(-5.0, 5.0)


@pytest.mark.property
@given(numbers, numbers, numbers, st.floats(1e-6, 8.0), st.integers(2, 20))
def test_the_lag_of_a_straight_command_needs_no_small_steps(lagged, previous, present, rate_dt, pieces):
    whole = advance_lag(lagged, previous, present, rate_dt)
    commands = np.linspace(previous, present, pieces + 1)
    for a, b in itertools.pairwise(commands):
        lagged = advance_lag(lagged, a, b, rate_dt / pieces)
    # slopes are differences over rate_dt: round-off grows as it falls
    assert lagged == pytest.approx(whole, abs=1e-9 / min(rate_dt, 1.0))


@pytest.mark.oracle
def test_the_lag_agrees_with_scipys_first_order_hold():
    times = np.arange(0.0, 1.0, 1e-3)
    drive = 4.0 * np.abs(np.sin(2 * np.pi * 2.2 * times + 0.3))
    _, expected, _ = lsim(([[-100.0]], [[100.0]], [[1.0]], [[0.0]]), drive, times, X0=[drive[0]], interp=True)
    lagged = lag_series(drive, 1e-3, 100.0)
    np.testing.assert_allclose(lagged, expected, atol=1e-11)


@pytest.mark.property
def test_a_drive_rises_and_falls_with_rates_of_its_own():
    drive = np.repeat([0.0, 2.0, 0.0], 200)
    zero = np.zeros(600)
    step = driver_lag_apart(100.0, 30.0)
    u = run_chain(build_chain([polynomial_coefficients([1.0], [1.0]), step]), zero, zero, zero, drive, 1e-3)[:, CURRENT]
    # within a millisecond the command runs straight from one level to the other: half a sample of the rise is left out
    assert u[210:390] == pytest.approx(2.0 - 2.0 * np.exp(-100.0 * (np.arange(210, 390) - 199.5) * 1e-3), abs=1e-3)
    assert u[410:590] == pytest.approx(u[400] * np.exp(-30.0 * (np.arange(410, 590) - 400) * 1e-3), rel=1e-3)
    both = [
        run_chain(build_chain([polynomial_coefficients([1.0], [1.0]), item]), zero, zero, zero, drive, 1e-3)[:, CURRENT]
        for item in (driver_lag(50.0), driver_lag_apart(50.0, 50.0))
    ]
    np.testing.assert_allclose(both[0], both[1])


@pytest.mark.property
def test_steps_write_what_the_polynomials_give():
    drive = np.linspace(0.0, 4.0, 50)
    zero = np.zeros(50)
    chain = build_chain([polynomial_coefficients([1.0, 2.0, 3.0, -0.5], [10.0, 4.0]), driver_lag(80.0)])
    wires = run_chain(chain, zero, zero, zero, drive, 1e-3)
    u = wires[:, CURRENT]
    np.testing.assert_array_equal(u, lag_series(drive, 1e-3, 80.0))
    np.testing.assert_allclose(wires[:, YIELD_FORCE], 1.0 + 2.0 * u + 3.0 * u**2 - 0.5 * u**3, rtol=1e-13)
    np.testing.assert_allclose(wires[:, VISCOSITY], 10.0 + 4.0 * u, rtol=1e-13)
