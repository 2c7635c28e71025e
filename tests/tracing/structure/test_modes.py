"""Equations of the modes of a wall: frequencies, reciprocity, and a force that the other equations absorb."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg

from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.groups import groups_of
from tests.tracing.structure.towers import MASSES, bumped_wall, stiffness_of, tower_records


def problem_of(kind: str) -> FrameProblem:
    records = tower_records(kind, noise=0.002)
    found = frame_problem(records[:2], records[2:], MASSES)
    return found.in_modes(found.training)


@pytest.fixture(scope="module")
def wall() -> FrameProblem:
    return problem_of("wall")


@pytest.mark.planted
def test_the_modes_of_a_wall_that_are_excited_are_found_and_leave_noise(wall: FrameProblem) -> None:
    assert wall.modal is not None
    truth = np.sqrt(linalg.eigh(stiffness_of("wall"), np.diag(MASSES), eigvals_only=True))
    found = np.sqrt(wall.modal.stiffness)
    assert 2 <= len(found) < len(MASSES)
    np.testing.assert_allclose(found, truth[: len(found)], rtol=0.01)
    design = design_of("linear-frame", wall.judged)
    assert not groups_of(design, wall.rules).material(design.residual)


@pytest.mark.property
def test_modes_are_normalised_by_the_masses_and_their_forces_belong_to_the_equations(wall: FrameProblem) -> None:
    assert wall.modal is not None
    modes = wall.modal.modes
    one = np.eye(len(modes.filters))
    np.testing.assert_allclose(modes.filters / MASSES @ modes.filters.T, one, atol=1e-9)
    np.testing.assert_allclose(modes.equations @ modes.forces, one, atol=1e-9)


@pytest.mark.property
def test_a_shear_frame_is_judged_in_the_equations_of_its_storeys() -> None:
    assert problem_of("shear").modal is None


@pytest.mark.property
def test_a_wall_with_a_measured_force_is_judged_in_the_equations_of_its_storeys() -> None:
    # a linear frame with a damper would otherwise leave more than noise, because higher modes follow the force
    records = tower_records("wall", noise=0.002)
    forced = [replace(item, loads={3: np.zeros_like(item.ground)}) for item in records]
    found = frame_problem(forced[:2], forced[2:], MASSES)
    assert found.in_modes(found.training).modal is None


@pytest.mark.planted
def test_the_force_of_a_bumper_remains_in_the_equations_of_modes_only() -> None:
    """The higher modes follow the force, so that their displacements explain it in the equations of the storeys."""
    records = bumped_wall()
    problem = frame_problem(records[:2], records[2:], MASSES)
    modal = problem.in_modes(problem.training)
    assert modal.modal is not None
    of_storeys, of_modes = (design_of("linear-frame", item.judged).chi_square for item in (problem, modal))
    assert of_modes > 10.0 * of_storeys
