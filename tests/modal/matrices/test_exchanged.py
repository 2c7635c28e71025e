"""Sensors at other floors than declared."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from mrpipe.artifacts import FloatArray
from mrpipe.modal.matrices.exchanged import exchanged_finding, exchanged_floors
from mrpipe.structures import Frame, natural_modes
from tests.modal.towers import random_tower

pytestmark = pytest.mark.planted


def _modes(seed: int, floors: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return masses, shapes with an error of 1 %, its size, and frequencies of a tower with coupled floors."""
    rng = np.random.default_rng(seed)
    tower = random_tower(rng, floors)
    modes = natural_modes(Frame(np.diag(tower.mass), np.zeros((floors, floors)), tower.stiffness))
    shapes = modes.mode_shapes
    errors = 0.01 * np.ones_like(shapes) * np.abs(shapes).max(axis=0)
    return tower.mass, shapes + errors * rng.standard_normal(shapes.shape), errors, modes.angular_frequencies


@pytest.mark.parametrize("seed", range(8))
def test_declared_floors_have_no_finding(seed: int) -> None:
    masses, shapes, errors, omega = _modes(seed, 3 + seed % 6)
    assert exchanged_floors(masses, shapes, errors, omega) == ()


@pytest.mark.parametrize("seed", range(3))
def test_an_order_of_four_floors_is_found_or_nothing_is_said(seed: int) -> None:
    masses, shapes, errors, omega = _modes(seed, 4)
    named = 0
    for order in permutations(range(4)):
        rows = list(order)
        found = exchanged_floors(masses, shapes[rows], errors[rows], omega)
        # sensor i records floor order[i]
        assert found in ((), (0,) * 4, tuple(row + 1 for row in rows))
        named += found not in ((), (0,) * 4)
    # small elements hide some exchanges, and some orders are as good as others
    assert named >= 8


def test_two_exchanged_sensors_of_a_high_tower_are_found() -> None:
    masses, shapes, errors, omega = _modes(4, 8)
    rows = [0, 1, 5, 3, 4, 2, 6, 7]
    assert exchanged_floors(masses, shapes[rows], errors[rows], omega) == (1, 2, 6, 4, 5, 3, 7, 8)


def _wall(floors: int) -> FloatArray:
    """Return the stiffness of a wall in bending with equal storeys, from its flexibility [N/m]."""
    height = np.arange(1, floors + 1) * 3.0
    low, high = np.minimum.outer(height, height), np.maximum.outer(height, height)
    return np.asarray(np.linalg.inv(low**2 * (3.0 * high - low) / (6.0 * 2e9)))


@pytest.mark.parametrize("floors", [4, 5, 6])
def test_a_wall_in_bending_is_not_upside_down(floors: int) -> None:
    masses = 25e3 * np.linspace(1.1, 0.9, floors)
    modes = natural_modes(Frame(np.diag(masses), np.zeros((floors, floors)), _wall(floors)))
    shapes, errors = modes.mode_shapes, 1e-4 * np.ones((floors, floors))
    assert exchanged_floors(masses, shapes, errors, modes.angular_frequencies) == ()


def test_floors_numbered_from_the_top_are_named() -> None:
    masses, shapes, errors, omega = _modes(3, 5)
    rows = [4, 3, 2, 1, 0]
    assert exchanged_floors(masses[rows], shapes[rows], errors[rows], omega) == (5, 4, 3, 2, 1)


def test_the_sentence_names_the_floors() -> None:
    assert exchanged_finding((1, 3, 2, 4)).startswith("the sensors of floors 2 and 3 may be exchanged")
    assert "from the top" in exchanged_finding((3, 2, 1))
    assert "in several other orders" in exchanged_finding((0, 0, 0))
    assert "1 at floor 2" in exchanged_finding((2, 3, 1))
