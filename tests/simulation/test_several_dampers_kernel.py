"""Steps of the compiled loop of several dampers, called as Python: what forces add to the motion, and the brace."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.simulation.several_dampers_kernel import _finish_step, _motion_at_start
from mrpipe.simulation.several_dampers_parts import D_FLEXIBILITY, D_SIZE, F, Motion, Structure, V, X

pytestmark = pytest.mark.property

FLOORS, DAMPERS = 3, 2


def structure(rng: np.random.Generator) -> Structure:
    square, rows = (FLOORS, FLOORS), (DAMPERS, FLOORS)
    return Structure(
        step_matrix=rng.standard_normal((2 * FLOORS + 2 + DAMPERS, 2 * FLOORS)),
        at_end=rng.standard_normal((DAMPERS, 2 * FLOORS)),
        lower=rng.standard_normal((2 * FLOORS, FLOORS)),
        gains=rng.standard_normal(rows),
        M=rng.standard_normal(square),
        C=rng.standard_normal(square),
        K=rng.standard_normal(square),
        influence=np.ones((1, FLOORS)),
        pull=np.ones((1, FLOORS)),
        direct=np.zeros((1, FLOORS)),
        positions=rng.standard_normal(rows),
    )


def started(given: Structure, state: np.ndarray) -> Motion:
    return _motion_at_start.py_func(given, state)


def test_a_newton_of_each_damper_moves_every_damper_as_the_matrices_say() -> None:
    rng = np.random.default_rng(4)
    given, state = structure(rng), rng.standard_normal(2 * FLOORS)
    motion = started(given, state)
    accelerations = given.at_end @ given.lower + given.gains
    for found, by_force in zip(
        motion.added, (given.at_end[:, :FLOORS], given.at_end[:, FLOORS:], accelerations), strict=True
    ):
        assert found == pytest.approx(given.positions @ by_force.T)
    assert motion.known[:, X] == pytest.approx(given.positions @ state[:FLOORS])
    assert motion.known[:, V] == pytest.approx(given.positions @ state[FLOORS:])


def test_the_rate_of_a_brace_is_exact_for_a_parabola_and_is_taken_from_the_damper() -> None:
    rng = np.random.default_rng(5)
    given = structure(rng)
    motion = started(given, np.zeros(2 * FLOORS))
    settings, dt, stiffness = np.zeros((DAMPERS, D_SIZE)), 0.01, np.array([2e4, 5e4])
    settings[:, D_FLEXIBILITY] = 1.0 / stiffness

    def deformation(time: float) -> np.ndarray:
        return np.array([0.003, 0.001]) + np.array([0.2, -0.1]) * time + np.array([1.5, 4.0]) * time**2

    # two steps in the past, one step in the past, now
    motion.braces[:, 1], motion.braces[:, 0] = deformation(-2.0 * dt), deformation(-dt)
    before = stiffness * deformation(-dt)
    motion.forces[:], motion.answer[:, 6] = before, stiffness * deformation(0.0)
    free = np.zeros(2 * FLOORS)
    _finish_step.py_func(given.positions, given.at_end, settings, motion, free, dt)
    assert motion.braces[:, 2] == pytest.approx([0.2, -0.1])
    assert free == pytest.approx(motion.forces @ given.at_end)
    assert motion.known[:, X] == pytest.approx(given.positions @ free[:FLOORS] - deformation(0.0))
    assert motion.known[:, V] == pytest.approx(given.positions @ free[FLOORS:] - np.array([0.2, -0.1]))
    assert motion.known[:, F] == pytest.approx(stiffness * deformation(0.0))
    assert motion.works == pytest.approx(0.5 * (before + motion.forces) * motion.known[:, X])


def test_the_acceleration_of_a_rod_by_its_brace_is_exact_for_a_cubic() -> None:
    """The filter of the controller reads it: a difference of the last two rates would be half a step late."""
    rng = np.random.default_rng(6)
    given = structure(rng)
    motion = started(given, np.zeros(2 * FLOORS))
    settings, dt, stiffness = np.zeros((DAMPERS, D_SIZE)), 0.01, np.array([2e4, 5e4])
    settings[:, D_FLEXIBILITY] = 1.0 / stiffness
    free = np.zeros(2 * FLOORS)
    for step in range(-4, 1):
        time = step * dt
        deformation = np.array([0.2, -0.1]) * time + np.array([1.5, 4.0]) * time**2 + np.array([30.0, -20.0]) * time**3
        motion.answer[:, 6] = stiffness * deformation
        _finish_step.py_func(given.positions, given.at_end, settings, motion, free, dt)
    assert motion.rod == pytest.approx([-3.0, -8.0])
