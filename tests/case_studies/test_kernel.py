"""Parts of the compiled loop of the benchmark structures, against linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from mrpipe.case_studies.kernel import damping_power, free_step, input_work, interpolate, observe, rod_motion
from mrpipe.signals.discretisation import discretise_first_order
from mrpipe.simulation.parts import multiply

pytestmark = pytest.mark.property

RNG = np.random.default_rng(3)


def test_loads_are_linear_between_their_samples() -> None:
    loads = RNG.standard_normal((4, 2))
    fine = np.array([np.interp(np.arange(13) / 4.0, np.arange(4), column) for column in loads.T]).T
    now, after = np.zeros(2), np.zeros(2)
    for k in range(12):
        interpolate(loads, k, 4, now, after)
        assert now == pytest.approx(fine[k]) and after == pytest.approx(fine[k + 1])


def test_both_steps_are_the_matrix_exponential() -> None:
    omega, dt = np.array([3.0, 7.0]), 0.05
    damping = np.diag([0.2, 0.5])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.diag(omega**2), -damping]])
    state, now, after = RNG.standard_normal(4), RNG.standard_normal(2), RNG.standard_normal(2)
    step, B0, B1 = discretise_first_order(A, np.vstack([np.zeros((2, 2)), np.eye(2)]), dt)
    expected = step @ state + B0 @ now + B1 @ after
    assert step == pytest.approx(expm(A * dt))
    blocks, pulses = np.zeros((2, 4)), np.zeros((2, 4))
    for mode in range(2):
        places = [mode, mode + 2]
        blocks[mode] = step[np.ix_(places, places)].ravel()
        pulses[mode] = B0[mode, mode], B1[mode, mode], B0[mode + 2, mode], B1[mode + 2, mode]
    structure = (step.T.copy(), B0.T.copy(), B1.T.copy(), blocks, pulses)
    for classical in (True, False):
        result = np.zeros(4)
        free_step(classical, structure, state, now, after, result)
        assert result == pytest.approx(expected)


def test_products_and_rod_motion() -> None:
    A, vector, result = RNG.standard_normal((3, 4)), RNG.standard_normal(4), np.zeros(3)
    multiply(A.T.copy(), vector, result)
    assert result == pytest.approx(A @ vector)
    positions, x, v = RNG.standard_normal((2, 2)), np.zeros(2), np.zeros(2)
    rod_motion(positions, vector, x, v)
    assert x == pytest.approx(positions @ vector[:2]) and v == pytest.approx(positions @ vector[2:])


def test_power_and_work() -> None:
    state, new = RNG.standard_normal(4), RNG.standard_normal(4)
    coupled = np.array([[0.4, 0.1], [0.1, 0.3]])
    assert damping_power(False, state, coupled) == pytest.approx(state[2:] @ coupled @ state[2:])
    diagonal = np.diag([0.4, 0.3])
    assert damping_power(True, state, diagonal) == pytest.approx(damping_power(False, state, diagonal))
    load, now, after = RNG.standard_normal((1, 2)), np.array([2.0]), np.array([4.0])
    moved = float(load[0] @ (new[:2] - state[:2]))
    assert input_work(False, load, now, after, state, new) == pytest.approx(3.0 * moved)


def test_the_observer_is_its_equation() -> None:
    states, outputs, devices = 4, 3, 1
    step, gain = RNG.standard_normal((states, states)), RNG.standard_normal((states, outputs))
    force_input, feedback = RNG.standard_normal((states, devices)), RNG.standard_normal((devices, states))
    measure, direct = RNG.standard_normal((outputs, states)), RNG.standard_normal((outputs, devices))
    noise = RNG.standard_normal((5, outputs))
    control = (np.zeros((1, 1)), step.T.copy(), force_input.T.copy(), gain.T.copy(), feedback, measure.T.copy(),
               direct.T.copy(), noise)  # fmt: skip
    state, force, estimate = RNG.standard_normal(states), np.array([0.7]), RNG.standard_normal(states)
    before, wanted = estimate.copy(), np.zeros(devices)
    observe(control, 7, state, force, estimate, wanted)
    y = measure @ state - direct @ force + noise[7 % 5]
    assert wanted == pytest.approx(feedback @ before)
    assert estimate == pytest.approx(step @ before - force_input @ force + gain @ y)
