"""Regulator and observer against the control package."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.control import kernel
from mrpipe.control.laws._regulator import observe
from mrpipe.control.lqg import Weights, frame_observer_gain, frame_regulator_gain, lqg_observer, state_weight
from mrpipe.errors import UserError
from mrpipe.signals.discretisation import discretise_zero_order
from mrpipe.structures import Frame, state_space
from mrpipe.structures.reduction import craig_bampton

control = pytest.importorskip("control")


@pytest.mark.oracle
@pytest.mark.parametrize("weights", [Weights(), Weights(energy=0.0, top_displacement=1e4), Weights(force=1e-3)])
def test_regulator_equals_the_control_package(thesis_frame, floor_one, weights):
    space = state_space(thesis_frame, floor_one)
    theirs, _, poles = control.lqr(space.A, space.B[:, 1:], state_weight(thesis_frame, weights), [[weights.force]])
    ours = frame_regulator_gain(thesis_frame, floor_one, weights)
    np.testing.assert_allclose(ours, theirs[0], rtol=1e-9, atol=1e-9 * np.abs(theirs).max())
    # one minus sign: the loop is stable (errata row 18)
    assert np.max(np.linalg.eigvals(space.A - np.outer(space.B[:, 1], ours)).real) < 0.0
    assert np.max(poles.real) < 0.0


@pytest.mark.oracle
def test_observer_equals_the_control_package(thesis_frame, floor_one):
    weights, dt = Weights(), 0.005
    n = thesis_frame.floors
    space = state_space(thesis_frame, -floor_one)
    Ad, Bd = discretise_zero_order(space.A, space.B, dt)
    C = np.vstack([np.concatenate([floor_one, np.zeros(n)]), space.absolute_acceleration()[0]])
    W = weights.ground_noise_m_s2**2 * np.outer(Bd[:, 0], Bd[:, 0])
    W[n:, n:] += (0.05 * weights.ground_noise_m_s2 * dt) ** 2 * np.eye(n)
    W += weights.force_noise_n**2 * np.outer(Bd[:, 1], Bd[:, 1])
    direct = np.concatenate([[0.0], space.absolute_acceleration()[1][:, 1]])
    V = np.diag([weights.displacement_noise_m**2] + [weights.acceleration_noise_m_s2**2] * n)
    V += weights.force_noise_n**2 * np.diag(direct**2)
    theirs, _, _ = control.dlqe(Ad, np.eye(2 * n), C, W, V)
    ours = frame_observer_gain(thesis_frame, floor_one, weights, dt)
    # theirs is the gain of the predictor A P C' (C P C' + V)^-1, as ours
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(ours).max())


@pytest.mark.property
def test_observer_follows_the_plant_without_noise(thesis_frame, floor_one):
    """Started from nothing, the estimate ends on the state, the force being what the controller thinks it is."""
    dt = 0.005
    observer = lqg_observer(thesis_frame, floor_one, Weights(), dt)
    space = state_space(thesis_frame, -floor_one)
    Ad, Bd = discretise_zero_order(space.A, space.B, dt)
    C, D = space.absolute_acceleration()
    z = np.zeros(10)
    z[4] = 0.01
    estimate = np.zeros(10)
    for step in range(4000):
        u = np.array([0.3 * np.sin(8.0 * step * dt), 5.0 * np.sin(3.0 * step * dt)])
        y = np.concatenate([[z[0]], [u[0]], C @ z + D @ u])
        estimate = observer.transition @ estimate + observer.force_input * u[1] + observer.innovation @ y
        z = Ad @ z + Bd @ u
    np.testing.assert_allclose(estimate, z, atol=1e-6 * np.abs(z).max())


@pytest.mark.golden
def test_singular_mass_is_told(floor_one):
    frame = Frame(np.diag([1.0, 1.0, 1.0, 1.0, 0.0]), np.zeros((5, 5)), np.eye(5), "mine")
    with pytest.raises(UserError, match="frame mine: mass: is singular"):
        frame_regulator_gain(frame, floor_one, Weights())


@pytest.mark.property
def test_the_top_is_the_last_place_that_moves_with_the_ground(thesis_frame):
    """Rotations and amplitudes of modes come after it, and their squares are no displacements."""
    heavy = replace(thesis_frame, influence=np.array([1.0, 1.0, 1.0, 0.0, 0.0]))
    reduced = craig_bampton(thesis_frame, (0, 4), 2).frame
    for frame, top in ((thesis_frame, 4), (heavy, 2), (reduced, 1)):
        without, weighted = (state_weight(frame, Weights(top_displacement=value)) for value in (0.0, 7.0))
        expected = np.zeros_like(without)
        expected[top, top] = 7.0
        np.testing.assert_allclose(weighted - without, expected, atol=1e-9)


@pytest.mark.property
def test_amplitudes_of_modes_have_no_accelerometer(thesis_frame):
    reduced = craig_bampton(thesis_frame, (0, 4), 2).frame
    observer = lqg_observer(reduced, np.eye(4)[0], Weights(), 0.005)
    assert np.all(observer.innovation[:, 4:] == 0.0)
    assert np.all(np.any(observer.innovation[:, :4] != 0.0, axis=0))
    assert np.max(np.abs(np.linalg.eigvals(observer.transition))) < 1.0


@pytest.mark.oracle
def test_the_observer_of_a_large_structure_stays_within_its_memory():
    """The estimate of 280 states had been held in an array of 256."""
    floors, rng = 140, np.random.default_rng(2)
    n, outputs = 2 * floors, floors + 2
    F, g, H, k = (rng.standard_normal(shape) for shape in ((n, n), (n,), (n, outputs), (n,)))
    numbers = np.concatenate([F.ravel(), g, H.ravel(), k])
    layout = np.zeros(64, dtype=np.int64)
    layout[kernel.FLOORS] = floors
    state, measured = rng.standard_normal(n), rng.standard_normal(kernel.MEASURED_FLOORS + floors)
    y = np.concatenate(
        [measured[[kernel.MEASURED_DISPLACEMENT, kernel.MEASURED_GROUND]], measured[kernel.MEASURED_FLOORS :]]
    )
    expected = F @ state + 3.0 * g + H @ y
    # the function before it is compiled checks the bounds of its arrays
    force = observe.py_func(numbers, layout, state, measured, 3.0)
    np.testing.assert_allclose(state, expected, rtol=1e-9, atol=1e-9)
    assert force == pytest.approx(-k @ expected, rel=1e-9)
