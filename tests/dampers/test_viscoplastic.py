"""Yield that depends on speed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrpipe.dampers.drive import coefficients
from mrpipe.dampers.laws import Law
from mrpipe.dampers.library import base_form
from mrpipe.dampers.plant import FORCE, HYSTERESIS, build_chain, run_chain
from mrpipe.dampers.viscoplastic import (
    advance_dashpot,
    power_of_velocity,
    saturating_dashpot,
    velocity_sign,
)


@pytest.mark.property
@given(st.floats(-3.0, 3.0), st.floats(-1.0, 1.0), st.floats(1.0, 1e4), st.floats(1e-3, 1.0))
def test_the_dashpot_settles_at_the_tanh_of_speed(theta, velocity, stiffness, scale):
    for _ in range(60):
        theta = advance_dashpot(theta, velocity, velocity, 10.0 / (stiffness * scale), stiffness, scale)
    assert np.tanh(theta) == pytest.approx(np.tanh(velocity / scale), abs=1e-6)


@pytest.mark.property
@given(st.floats(-8.0, 8.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(1e-6, 1.0), st.floats(1e-2, 1e5))
def test_the_dashpot_never_leaves_its_limits(theta, previous, present, dt, stiffness):
    after = advance_dashpot(theta, previous, present, dt, stiffness, 0.02)
    assert np.isfinite(after)
    assert abs(np.tanh(after)) <= 1.0


@pytest.mark.oracle
def test_the_dashpot_agrees_with_an_implicit_integrator_to_second_order():
    omega, stiffness, scale = 2 * np.pi * 1.5, 3000.0, 0.02

    def velocity(t):
        return 0.08 * np.cos(omega * t)

    def rate(t, z):
        return stiffness * (velocity(t) - scale * np.arctanh(np.clip(z, -1 + 1e-12, 1 - 1e-12)))

    end = 1.0
    answer = solve_ivp(rate, (0.0, end), [0.0], method="Radau", rtol=1e-9, atol=1e-11, dense_output=True)
    errors = []
    for dt in (1e-3, 5e-4):
        times = np.arange(0.0, end, dt)
        chain, zero = build_chain([saturating_dashpot(stiffness, scale)]), 0.0 * times
        z = run_chain(chain, zero, velocity(times), zero, zero, dt)[:, HYSTERESIS]
        errors.append(np.sqrt(np.mean((z - answer.sol(times)[0]) ** 2)))
    assert errors[0] < 2e-3
    assert errors[1] < 0.4 * errors[0]


@pytest.mark.property
def test_rounded_yield_adds_a_force_and_no_hysteresis():
    velocity = np.linspace(-0.2, 0.2, 41)
    zero, drive = np.zeros(41), np.full(41, 2.0)
    none = Law("polynomial", (0.0,))
    part = base_form("rounded-yield").steps({"yield_displacement": 1.0, "velocity_scale": 0.03})
    steps = [coefficients(none, none, Law("polynomial", (5.0, 7.0))), *part]
    wires = run_chain(build_chain(steps), zero, velocity, zero, drive, 1e-3)
    np.testing.assert_allclose(wires[:, FORCE], 19.0 * np.tanh(velocity / 0.03), rtol=1e-12, atol=1e-12)


@pytest.mark.property
def test_sign_jumps_and_power_is_one_at_its_reference():
    velocity = np.array([-0.1, 0.0, 0.05, 0.1])
    zero = np.zeros(4)
    wires = run_chain(build_chain([velocity_sign()]), zero, velocity, zero, zero, 1e-3)
    np.testing.assert_array_equal(wires[:, HYSTERESIS], [-1.0, 0.0, 1.0, 1.0])
    rate = run_chain(build_chain([power_of_velocity(0.1, 0.3)]), zero, velocity, zero, zero, 1e-3)[:, 18]
    np.testing.assert_allclose(rate, [1.0, 0.0, 0.5**0.3, 1.0], rtol=1e-14)
