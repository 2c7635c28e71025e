"""The hysteresis in displacement increments."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrpipe.dampers.drive import polynomial_coefficients
from mrpipe.dampers.forms import duhem
from mrpipe.dampers.forms.elastic_plastic import FORM as ELASTIC_PLASTIC
from mrpipe.dampers.hysteresis import (
    advance_hysteresis,
    displacement_between,
    hysteresis,
    parts_of,
    turning_share,
)
from mrpipe.dampers.model import bouc_wen_limits
from mrpipe.dampers.plant import HYSTERESIS, build_chain, run_chain
from tests.dampers.series import hysteresis_series

shares = st.floats(0.05, 1.5)
starts = st.floats(-1.0, 1.0)
increments = st.floats(-6.0, 6.0)
closed_exponents = st.sampled_from([1.0, 2.0])


@pytest.mark.property
@given(starts, increments, shares, closed_exponents, st.integers(2, 40))
def test_one_long_step_equals_many_short_ones(zeta, path, share, exponent, pieces):
    whole = advance_hysteresis(zeta, path, 1.0, share, exponent)
    parts = zeta
    for _ in range(pieces):
        parts = advance_hysteresis(parts, path / pieces, 1.0, share, exponent)
    assert parts == pytest.approx(whole, abs=1e-9)


@pytest.mark.oracle
@pytest.mark.parametrize("exponent", [1.3, 3.0, 8.0, 50.0])
@pytest.mark.parametrize("start", [-0.9, 0.0, 0.6])
def test_any_exponent_agrees_with_an_adaptive_integrator(exponent, start):
    share, path = 0.7, 2.5

    def rate(s, y):
        unloading = 1.0 - 2.0 * share
        return [1.0 - y[0] ** exponent if y[0] >= 0.0 else 1.0 - unloading * (-y[0]) ** exponent]

    answer = solve_ivp(rate, (0.0, path), [start], rtol=1e-10, atol=1e-12, max_step=1e-3)
    assert advance_hysteresis(start, path, 1.0, share, exponent) == pytest.approx(answer.y[0, -1], abs=1e-5)


@pytest.mark.oracle
@pytest.mark.parametrize(("power", "tilt", "curvature"), [(0.4, -1.0, 0.5), (1.2, 0.3, 0.0), (4.0, 2.0, -1.0)])
@pytest.mark.parametrize("path", [0.1, 0.8, 4.0])
def test_duhem_agrees_with_an_adaptive_integrator(power, tilt, curvature, path):
    def rate(s, y):
        return [max(1.0 - y[0], 0.0) ** power * np.exp(y[0] * (tilt + curvature * y[0]))]

    answer = solve_ivp(rate, (0.0, path), [-0.95], rtol=1e-10, atol=1e-12, max_step=1e-3)
    numbers = np.array([1.0, power, tilt, curvature])
    assert duhem._advanced(-0.95, path, numbers) == pytest.approx(answer.y[0, -1], abs=1e-5)


@pytest.mark.property
@given(starts, increments, shares, st.floats(1.0, 6.0))
def test_the_variable_stays_within_its_limits(zeta, path, share, exponent):
    assert -1.0 <= advance_hysteresis(zeta, path, 1.0, share, exponent) <= 1.0


@pytest.mark.property
@given(starts, st.floats(0.0, 6.0), shares, closed_exponents)
def test_mirror_image(zeta, path, share, exponent):
    forward = advance_hysteresis(zeta, path, 1.0, share, exponent)
    assert advance_hysteresis(-zeta, -path, 1.0, share, exponent) == pytest.approx(-forward, abs=1e-14)


@pytest.mark.property
@settings(max_examples=30)
@given(st.floats(0.2, 20.0), st.floats(0.5, 1.5), st.floats(1.0, 4.0))
def test_a_closed_loop_dissipates(amplitude, share, exponent):
    phase = np.linspace(0.0, 6.0 * np.pi, 3001)
    displacement = amplitude * np.sin(phase)
    zeta = hysteresis_series(displacement, 1.0, share, exponent)
    last = slice(2000, 3001)
    work = np.trapezoid(zeta[last], displacement[last])
    assert work > 0.0


def _integrated(displacement, velocity, A, gamma, beta, n, duration):
    """(2.2) itself, by an adaptive integrator that knows nothing of the closed form."""

    def rate(t, z):
        v = velocity(t)
        return -gamma * abs(v) * z * abs(z) ** (n - 1) - beta * v * abs(z) ** n + A * v

    times = np.arange(0.0, duration, 1e-3)
    answer = solve_ivp(rate, (0.0, duration), [0.0], t_eval=times, rtol=1e-9, atol=1e-12, max_step=2e-3)
    return times, answer.y[0], displacement(times)


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("n", "gamma", "beta"),
    [
        (2.0, 1230.0, 1230.0),
        (2.0, 2000.0, -400.0),
        (2.0, 700.0, 1500.0),
        (1.0, 1000.0, 500.0),
        (1.0, 1200.0, 0.0),
        (1.6, 1230.0, 1230.0),
        (3.0, 3000.0, 1000.0),
    ],
)
def test_agrees_with_an_adaptive_integrator(n, gamma, beta):
    omega = 2 * np.pi * 1.8
    _, z, displacement = _integrated(
        lambda t: 5e-3 * np.sin(omega * t) + 2e-3 * np.sin(2.7 * omega * t),
        lambda t: 5e-3 * omega * np.cos(omega * t) + 5.4e-3 * omega * np.cos(2.7 * omega * t),
        3000.0,
        gamma,
        beta,
        n,
        1.2,
    )
    z_max, yield_displacement, share = bouc_wen_limits(3000.0, gamma, beta, n)
    zeta = hysteresis_series(displacement, yield_displacement, share, n)
    # a sample does not fall on the turning point: what is missed there is a hundredth of a yield displacement
    assert np.max(np.abs(zeta - z / z_max)) < 0.02
    assert np.sqrt(np.mean((zeta - z / z_max) ** 2)) < 1e-3


@pytest.mark.property
def test_step_and_series_agree_and_restart_with_each_recording():
    rng = np.random.default_rng(3)
    displacement = np.cumsum(rng.normal(size=400)) * 1e-4
    zero = np.zeros(200)
    chain = build_chain([hysteresis(3e-4, 0.4, 2.0)])
    for part in (displacement[:200], displacement[200:]):
        wires = run_chain(chain, part, zero, zero, zero, 1e-3)
        np.testing.assert_array_equal(wires[:, HYSTERESIS], hysteresis_series(part, 3e-4, 0.4, 2.0))


@pytest.mark.property
@given(st.floats(-0.99, 0.99), st.floats(0.05, 0.8))
def test_the_turning_point_of_a_sine(phase, step):
    """The samples are `step` radians apart; the motion sin turns at pi/2, `phase` of a step after their middle."""
    before = 0.5 * np.pi - 0.5 * step * (1.0 + phase)
    after = before + step
    motion = np.sin(before), np.cos(before), np.sin(after), np.cos(after)
    share = turning_share(*motion, step)
    assert share == pytest.approx((0.5 * np.pi - before) / step, abs=0.01 * step**2 + 1e-9)
    assert displacement_between(share, *motion, step) == pytest.approx(1.0, abs=0.01 * step**4 + 1e-12)


@pytest.mark.property
@given(st.floats(-1.0, 1.0), st.floats(0.0, 2.0), st.floats(-1.0, 1.0))
def test_a_motion_that_does_not_turn_has_no_turning_point(before, speed, after):
    assert turning_share(before, speed, after, 0.5 * speed, 0.1) == 1.0
    assert displacement_between(1.0, before, speed, after, 0.5 * speed, 0.1) == after


@pytest.mark.property
@pytest.mark.parametrize("name", ["hysteresis", "elastic-plastic"])
def test_a_stiff_yield_is_followed_at_250_hz(name):
    """Without turning points the error is five times as large, because each reversal lacks a part of the path."""

    def force(dt):
        t = np.arange(0.0, 4.0, dt)
        x, v = 0.036 * np.sin(9.7 * t), 0.036 * 9.7 * np.cos(9.7 * t)
        if name == "hysteresis":
            step = hysteresis(4e-4, 0.5, 2.0)
        else:
            step = ELASTIC_PLASTIC.steps({"initial_stiffness": 1.0 / 4e-4, "exponent": 20.0})[0]
        one = polynomial_coefficients([1.0], [0.0])
        wires = run_chain(build_chain([one, step]), x, v, np.gradient(v, dt), np.ones_like(t), dt)
        return wires[:, HYSTERESIS], x

    fine, _ = force(1e-5)
    coarse, x = force(4e-3)
    expected = fine[::400]
    error = np.sqrt(np.mean((coarse - expected) ** 2))
    without = hysteresis_series(x, 4e-4, 0.5, 2.0 if name == "hysteresis" else 20.0)
    assert error < 0.002
    assert error < 0.2 * np.sqrt(np.mean((without - expected) ** 2))


@pytest.mark.property
@pytest.mark.parametrize(("interval_s", "parts"), [(0.5e-3, 1), (1e-3, 1), (2e-3, 2), (4e-3, 4), (20e-3, 4)])
def test_parts_of_an_interval(interval_s: float, parts: int) -> None:
    """Forms are ranked on records thinned to 20 ms, whose intervals in 20 parts took ten times as long."""
    assert parts_of(interval_s) == parts
