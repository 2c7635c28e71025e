"""What must hold for a structure that is given, and what is said where it does not."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.structures import Frame, frame_from_modes, natural_modes, shear_frame
from mrpipe.structures.given_checks import (
    require_dissipation,
    require_restoring_forces,
    tell_of_asymmetric_damping,
    tell_of_changed_modes,
    tell_of_equal_matrices,
)

FRAME = shear_frame([2.0, 3.0, 1.0], [500.0, 400.0, 300.0], 0.02)

pytestmark = pytest.mark.property


def test_a_free_structure_is_refused_and_a_soft_one_is_not() -> None:
    free = FRAME.stiffness - np.diag([500.0, 0.0, 0.0])
    with pytest.raises(UserError, match="restoring force"):
        require_restoring_forces(Frame(FRAME.mass, FRAME.damping, free))
    require_restoring_forces(Frame(FRAME.mass, FRAME.damping, free + np.diag([1e-3, 0.0, 0.0])))


def test_negative_damping_is_refused_and_none_is_not() -> None:
    require_dissipation(np.array([0.01, 0.0]))
    with pytest.raises(UserError, match=r"mode 2 the damping ratio -0\.02"):
        require_dissipation(np.array([0.01, -0.02]))


def test_asymmetric_damping_is_told() -> None:
    warnings: list[str] = []
    tell_of_asymmetric_damping(FRAME.damping, warnings.append)
    assert not warnings
    tell_of_asymmetric_damping(FRAME.damping + np.diag([1.0, 0.0], 1), warnings.append)
    assert len(warnings) == 1 and "[1, 2]" in warnings[0]


def test_a_stiffness_that_is_the_mass_matrix_is_told() -> None:
    warnings: list[str] = []
    tell_of_equal_matrices(FRAME, warnings.append)
    assert not warnings
    # a floor that is equally stiff in both directions
    tell_of_equal_matrices(Frame(np.diag([2.0, 2.0]), np.zeros((2, 2)), np.diag([500.0, 500.0])), warnings.append)
    assert not warnings
    tell_of_equal_matrices(Frame(FRAME.mass, FRAME.damping, 1e3 * FRAME.mass), warnings.append)
    assert len(warnings) == 1 and "the same numbers as the mass matrix" in warnings[0]


def test_modes_that_the_structure_does_not_have_are_told() -> None:
    # a diagonal modal mass matrix is only right for orthogonal shapes
    warnings: list[str] = []
    true = natural_modes(FRAME)
    masses, ratios = np.diag(FRAME.mass), np.full(3, 0.01)
    exact = frame_from_modes(true.mode_shapes, true.angular_frequencies, ratios, masses)
    tell_of_changed_modes(exact, true.frequencies_hz.tolist(), warnings.append)
    assert not warnings
    rough = frame_from_modes(np.round(true.mode_shapes, 1), true.angular_frequencies, ratios, masses)
    tell_of_changed_modes(rough, true.frequencies_hz.tolist(), warnings.append)
    found = natural_modes(rough).frequencies_hz
    worst = int(np.argmax(np.abs(found / true.frequencies_hz - 1.0)))
    assert len(warnings) == 1 and f"mode {worst + 1} has {found[worst]:.4g} Hz" in warnings[0]
