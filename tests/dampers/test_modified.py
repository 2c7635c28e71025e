"""The modified Bouc-Wen model against its own differential equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mrpipe.artifacts import load_parameter_set
from mrpipe.dampers import plant
from mrpipe.dampers.model import DamperModel, damper_from_parameter_set, thesis_parameters
from mrpipe.dampers.modified import series_step


def _p4_equations(times, amplitude, omega, volts, numbers, thesis):
    """P4 (1) to (4) at constant voltage, y and z integrated adaptively."""
    c0 = numbers["c0_a"] + numbers["c0_b"] * volts
    c1 = numbers["c1_a"] + numbers["c1_b"] * volts
    alpha = thesis["alpha_a"] + thesis["alpha_b"] * volts
    gamma, beta, A = thesis["gamma"], thesis["beta"], thesis["A"]

    def outer(t):
        return amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)

    def rate(t, state):
        y, z = state
        x, v = outer(t)
        y_dot = (alpha * z + c0 * v + numbers["k0"] * (x - y)) / (c0 + c1)
        w = v - y_dot
        return [y_dot, -gamma * abs(w) * z * abs(z) - beta * w * z**2 + A * w]

    answer = solve_ivp(
        rate, (0.0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-8, atol=1e-11, max_step=2e-3, method="LSODA"
    )
    y, z = answer.y
    x, v = outer(times)
    y_dot = (alpha * z + c0 * v + numbers["k0"] * (x - y)) / (c0 + c1)
    return c1 * y_dot + numbers["k1"] * (x - numbers["x0"])


@pytest.mark.oracle
@pytest.mark.parametrize("volts", [0.0, 10.0])
@pytest.mark.parametrize("series_share", [1.0, 0.01])
def test_the_chain_solves_p4_equations(volts, series_share):
    published = damper_from_parameter_set(load_parameter_set("dampers", "p4-1000kn"))
    numbers = dict(published.parameters)
    # a hundredth of the published series dashpot makes it matter; a stiff spring shows both springs
    numbers.update(c1_a=series_share * numbers["c1_a"], c1_b=series_share * numbers["c1_b"], k0=2e5, k1=1e5)
    model = DamperModel("modified-bouc-wen", numbers, "V", 10.0)
    times = np.arange(0.0, 2.0, 1e-3)
    amplitude, omega = 0.05, 2 * np.pi
    expected = _p4_equations(times, amplitude, omega, volts, numbers, thesis_parameters(model, 1107.2))
    force = model.force(
        amplitude * np.sin(omega * times),
        amplitude * omega * np.cos(omega * times),
        -amplitude * omega**2 * np.sin(omega * times),
        np.full_like(times, volts),
        1e-3,
    )
    # the model begins with the rod at rest, the equations at full speed: the first instants are left out
    late = slice(50, None)
    error = np.sqrt(np.mean((force[late] - expected[late]) ** 2) / np.mean(expected**2))
    assert error < 2e-3


@pytest.mark.property
def test_a_drive_below_zero_that_leaves_no_viscosity_gives_a_finite_motion() -> None:
    """A drive that lags by an oscillation undershoots zero; both viscosities were then zero (seed 52412)."""
    wire, state = np.zeros(32), np.zeros(3)
    wire[plant.CURRENT], wire[plant.DISPLACEMENT], wire[plant.VELOCITY] = -0.2, 1e-4, 0.1
    wire[plant.YIELD_FORCE], wire[plant.RATE_YIELD], wire[plant.VISCOSITY] = 60.0, 1.0, 0.0
    series_step(wire, state, np.array([1e-3, 0.05, 2.0, 270.0, 2700.0, 0.0]), 1e-3)
    assert np.all(np.isfinite(wire)) and np.all(np.isfinite(state))
