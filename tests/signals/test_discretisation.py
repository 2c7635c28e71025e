"""Exact steps of a linear system, against analytic solutions of an oscillator."""

import numpy as np
import pytest

from mrpipe.signals.discretisation import discretise_first_order, discretise_zero_order


def oscillator(zeta=0.0):
    """x'' + 2 zeta 10 x' + 100 x = -u."""
    return np.array([[0.0, 1.0], [-100.0, -20.0 * zeta]]), np.array([[0.0], [-1.0]])


@pytest.mark.property
def test_exact_step_equals_the_analytic_decay():
    omega, zeta = 10.0, 0.05
    step, _ = discretise_zero_order(*oscillator(zeta), 0.01)
    state = np.array([1e-3, 0.0])
    for _ in range(500):
        state = step @ state
    damped = omega * np.sqrt(1 - zeta**2)
    t = 5.0
    exact = 1e-3 * np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(damped * t))
    assert state[0] == pytest.approx(exact, rel=1e-9)


@pytest.mark.property
def test_zero_order_hold_is_exact_for_a_step():
    step, held = discretise_zero_order(*oscillator(), 0.02)
    state = np.zeros(2)
    for _ in range(300):
        state = step @ state + held @ [1.0]
    assert state[0] == pytest.approx(-(1.0 - np.cos(60.0)) / 100.0, rel=1e-9)


@pytest.mark.property
def test_first_order_hold_is_exact_for_a_ramp():
    step, first, second = discretise_first_order(*oscillator(), 0.02)
    state = np.zeros(2)
    for k in range(300):
        state = step @ state + first @ [0.02 * k] + second @ [0.02 * (k + 1)]
    t = 6.0
    assert state[0] == pytest.approx(-(t / 100.0 - np.sin(10.0 * t) / 1000.0), rel=1e-6)
