"""The second-order filter: what control theory says of its response."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.second_order import second_order_filter

pytestmark = pytest.mark.oracle


@njit
def _filtered(values: FloatArray, delay: float, damping_ratio: float, dt: float) -> FloatArray:
    state = np.zeros(3)
    result = np.zeros(len(values))
    for index in range(len(values)):
        second_order_filter(state, values[index], delay, damping_ratio, dt, 1 if index == 0 else 0)
        result[index] = state[0]
    return result


@pytest.mark.parametrize("damping_ratio", [0.5, 0.7, 1.5])
@pytest.mark.parametrize("delay", [0.002, 0.01, 0.05])
def test_agrees_with_the_exact_response_to_a_piecewise_linear_input(delay: float, damping_ratio: float) -> None:
    dt = 0.002
    time = np.arange(0.0, 1.0, dt)
    given = np.where(np.sin(13.0 * time) > 0.0, 1.0, -1.0) + np.sin(40.0 * time)
    omega = 2.0 * damping_ratio / delay
    system = signal.TransferFunction([omega**2], [1.0, 2.0 * damping_ratio * omega, omega**2])
    change = given - given[0]
    exact = given[0] + signal.lsim(system, change, time)[1]
    assert np.max(np.abs(_filtered(given, delay, damping_ratio, dt) - exact)) < 0.015


def test_slow_changes_are_late_by_the_delay() -> None:
    dt, delay = 0.001, 0.008
    ramp = np.arange(0.0, 1.0, dt)
    assert _filtered(ramp, delay, 0.7, dt)[-1] == pytest.approx(ramp[-1] - delay, rel=1e-6)


def test_no_delay_changes_nothing() -> None:
    given = np.sin(np.arange(100.0))
    np.testing.assert_array_equal(_filtered(given, 0.0, 0.7, 0.001), given)
