"""Kinematic Kalman filter: gains, discretisation, and the velocity errors of errata D."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrpipe.artifacts import FloatArray
from mrpipe.signals.differentiation import backward_difference
from mrpipe.signals.filters import butterworth_lowpass
from mrpipe.signals.kalman import continuous_kalman_gains, discretise, kinematic_kalman, kinematic_smoother

DT = 1e-3
NOISE_X, NOISE_A = 20e-6, 0.1


def sine(frequency: float, amplitude: float, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return noisy displacement, noisy acceleration and true velocity, 20 s at 1 kHz."""
    rng = np.random.default_rng(seed)
    t = np.arange(20_000) * DT
    omega = 2 * np.pi * frequency
    x = amplitude * np.sin(omega * t)
    noisy_x = x + NOISE_X * rng.standard_normal(t.size)
    noisy_a = -(omega**2) * x + NOISE_A * rng.standard_normal(t.size)
    return noisy_x, noisy_a, amplitude * omega * np.cos(omega * t)


def rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(error[2000:-2000] ** 2)))


MOTIONS = [(frequency, amplitude) for frequency in (0.5, 1.0, 2.2) for amplitude in (5e-3, 10e-3)]


@pytest.mark.literature
def test_gains_of_errata_d() -> None:
    gains = continuous_kalman_gains(NOISE_X, NOISE_A)
    assert gains.l == pytest.approx(5000.0) and gains.k == pytest.approx(100.0) and gains.m == 0.0


@pytest.mark.literature
@pytest.mark.parametrize(("frequency", "amplitude"), MOTIONS)
def test_velocity_error_of_errata_d(frequency: float, amplitude: float) -> None:
    x, a, v = sine(frequency, amplitude, seed=7)
    error = rms(kinematic_kalman(x, a, DT, continuous_kalman_gains(NOISE_X, NOISE_A))[1] - v)
    assert 0.8 * 0.4e-3 < error < 1.2 * 0.8e-3
    # the steady covariance of the continuous filter says what the error must be
    expected = np.sqrt(np.sqrt(2.0) * NOISE_A**1.5 * NOISE_X**0.5 * DT)
    assert error == pytest.approx(expected, rel=0.2)


@pytest.mark.literature
@pytest.mark.parametrize(("frequency", "amplitude"), [motion for motion in MOTIONS if motion[0] >= 1.0])
def test_difference_and_causal_filter_err_as_errata_d_says(frequency: float, amplitude: float) -> None:
    x, _, v = sine(frequency, amplitude, seed=7)
    error = rms(butterworth_lowpass(backward_difference(x, DT), 20.0, 1 / DT, phase="causal") - v)
    assert 0.8 * 1.7e-3 < error < 1.2 * 16e-3


@pytest.mark.literature
def test_a_bias_of_the_accelerometer_and_its_remedy() -> None:
    x, a, v = sine(1.0, 5e-3, seed=1)
    gains = continuous_kalman_gains(NOISE_X, NOISE_A)
    error = kinematic_kalman(x, a + 0.3, DT, gains)[1] - v
    assert np.mean(error[2000:]) == pytest.approx(0.3 * gains.k / gains.l, rel=0.02)
    _, velocity, bias = kinematic_kalman(x, a + 0.3, DT, continuous_kalman_gains(NOISE_X, NOISE_A, 0.2))
    assert abs(np.mean((velocity - v)[5000:])) < 0.02 * 0.3 * gains.k / gains.l
    assert np.mean(bias[5000:]) == pytest.approx(0.3, rel=0.02)
    # forwards and backwards the bias cancels without a state for it
    smoothed = kinematic_smoother(x, a + 0.3, DT, gains)[1]
    assert abs(np.mean((smoothed - v)[2000:-2000])) < 0.02 * 0.3 * gains.k / gains.l


@pytest.mark.planted
@pytest.mark.parametrize(("frequency", "amplitude"), MOTIONS)
def test_smoothing_halves_the_variance_and_adds_no_delay(frequency: float, amplitude: float) -> None:
    x, a, v = sine(frequency, amplitude, seed=3)
    gains = continuous_kalman_gains(NOISE_X, NOISE_A)
    ahead, both = (method(x, a, DT, gains)[1] - v for method in (kinematic_kalman, kinematic_smoother))
    assert rms(both) < 0.8 * rms(ahead)
    lag = np.sum(both[2000:-2000] * np.gradient(v, DT)[2000:-2000]) / np.sum(np.gradient(v, DT)[2000:-2000] ** 2)
    assert abs(lag) < 2e-4


@pytest.mark.oracle
@pytest.mark.parametrize("drift", [0.0, 0.02, 3.0])
def test_gains_equal_the_riccati_solution_of_control(drift: float) -> None:
    gains = continuous_kalman_gains(NOISE_X, NOISE_A, drift)
    size = 3 if drift else 2
    state = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])[:size, :size]
    noise = np.diag([0.0, NOISE_A**2, drift**2])[:size, :size]
    gain = control.lqe(state, np.eye(size), np.eye(1, size), noise, np.array([[NOISE_X**2]]))[0][:, 0]
    expected = [gains.k, gains.l, -gains.m][:size]
    np.testing.assert_allclose(gain, expected, rtol=1e-6)


@pytest.mark.oracle
def test_recursion_equals_the_differential_equation() -> None:
    gains = continuous_kalman_gains(NOISE_X, NOISE_A, 0.05)
    rng = np.random.default_rng(0)
    y, a = 1e-3 * rng.standard_normal(60), rng.standard_normal(60)
    t = np.arange(60) * DT

    def rate(time: float, state: FloatArray) -> list[float]:
        error = np.interp(time, t, y) - state[0]
        return [
            state[1] + gains.k * error,
            np.interp(time, t, a) - state[2] + gains.l * error,
            -gains.m * error,
        ]

    exact = np.empty((60, 3))
    exact[0] = [y[0], 0.0, 0.0]
    for n in range(1, 60):
        exact[n] = solve_ivp(rate, (t[n - 1], t[n]), exact[n - 1], rtol=1e-10, atol=1e-14).y[:, -1]
    ours = np.column_stack(kinematic_kalman(y, a, DT, gains))
    np.testing.assert_allclose(ours, exact, rtol=1e-6, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-6, 1e-3), st.floats(1e-3, 10.0), st.just(0.0) | st.floats(1e-2, 10.0), st.floats(1e-4, 1e-2))
@pytest.mark.property
def test_the_filter_is_stable_and_true_to_constant_acceleration(
    noise_x: float, noise_a: float, drift: float, dt: float
) -> None:
    gains = continuous_kalman_gains(noise_x, noise_a, drift)
    transition, previous, present = discretise(gains, dt)
    active = 3 if drift > 0.0 else 2
    assert np.max(np.abs(np.linalg.eigvals(transition[:active, :active]))) < 1.0
    # with the true state, a motion under constant acceleration is followed over a step but for the parabola's chord,
    # which is negligible where the step resolves the filter
    assume(gains.k * dt < 0.3)
    state = np.array([0.0, 0.3, 0.0])
    after = transition @ state + previous @ [0.0, 2.0] + present @ [0.3 * dt + dt**2, 2.0]
    assert after[1] == pytest.approx(0.3 + 2.0 * dt, rel=0.02)


@pytest.mark.golden
@pytest.mark.parametrize("levels", [(0.0, 0.1, 0.0), (1e-5, -1.0, 0.0), (1e-5, 0.1, -1.0)])
def test_noise_levels_must_be_above_zero(levels: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="above zero"):
        continuous_kalman_gains(*levels)
