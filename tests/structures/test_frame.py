"""What a structure derives from its matrices and directions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.structures import Frame, natural_modes
from mrpipe.structures.given import without_massless

pytestmark = pytest.mark.property


def test_turned_directions_are_those_of_a_rotation() -> None:
    """A place that moves with x only has the cosine in the turned first direction and minus the sine in the second."""
    place = np.array([1.0, 0.0, 0.5])
    across = np.array([0.0, 1.0, 0.25])
    turned = Frame(np.eye(3), np.zeros((3, 3)), np.eye(3), influence=place, influence_y=across).turned(30.0)
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    np.testing.assert_allclose(turned.ground_influence, [c, s, 0.5 * c + 0.25 * s])
    np.testing.assert_allclose(turned.influence_y, [-s, c, 0.25 * c - 0.5 * s])


def test_a_condensed_structure_keeps_both_directions_of_the_places_with_mass() -> None:
    stiffness = np.array([[3.0, -1.0, 0.0], [-1.0, 3.0, -1.0], [0.0, -1.0, 1.0]])
    full = Frame(
        np.diag([1.0, 0.0, 2.0]),
        np.zeros((3, 3)),
        stiffness,
        influence=np.array([1.0, 0.0, 0.5]),
        influence_y=np.array([0.0, 0.0, 0.8]),
        degrees_of_freedom=("x", "turn", "z"),
    )
    found = without_massless(full)
    assert found.names == ("x", "z")
    np.testing.assert_array_equal(found.ground_influence, [1.0, 0.5])
    np.testing.assert_array_equal(found.influence_y, [0.0, 0.8])


def test_the_last_place_is_positive_in_every_mode() -> None:
    stiffness = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    shapes = natural_modes(Frame(np.eye(3), np.zeros((3, 3)), stiffness)).mode_shapes
    assert np.all(shapes[-1] > 0.0)
    assert np.any(shapes[0] < 0.0)


def test_the_force_on_the_ground_counts_masses_that_couple_places() -> None:
    """The base shear of a rigid motion with the ground is the whole mass times its acceleration."""
    mass = np.array([[2.0, 0.5], [0.5, 1.0]])
    frame = Frame(mass, np.zeros((2, 2)), np.eye(2))
    np.testing.assert_allclose(frame.ground_masses, [2.5, 1.5])
    assert frame.ground_masses @ np.ones(2) == pytest.approx(mass.sum())
    one = replace(frame, influence=np.array([1.0, 0.0]))
    np.testing.assert_allclose(one.ground_masses, [2.0, 0.5])
