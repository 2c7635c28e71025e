"""A mode whose shape is hardly known must not turn the shapes of the others, and follows from them."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.matrices.completion import completed_shapes
from tests.modal.towers import Tower, random_tower

WEAK = 2


def _seen(seed: int, missing: tuple[int, ...]) -> tuple[Tower, np.ndarray, np.ndarray, list[int]]:
    """Shapes with an error of 0.5 % (mode 3: 20 %); the rows of floors without a sensor are a wrong guess."""
    rng = np.random.default_rng(seed)
    tower = random_tower(rng, 7)
    measured = [floor for floor in range(7) if floor not in missing]
    unit = tower.shapes / np.linalg.norm(tower.shapes, axis=0)
    error = np.where(np.arange(7) == WEAK, 0.2, 0.005) / np.sqrt(7)
    seen = unit + error * rng.standard_normal((7, 7))
    seen[list(missing)] = unit[list(missing)] + 0.1 * rng.standard_normal((len(missing), 7))
    return tower, seen, np.broadcast_to(error, (7, 7)), measured


def _completed(seed: int, missing: tuple[int, ...]) -> tuple[Tower, np.ndarray]:
    tower, seen, errors, measured = _seen(seed, missing)
    return tower, completed_shapes(seen, errors, measured, tower.mass, 2.0 * np.pi * tower.frequencies_hz).shapes


def _assurance(tower: Tower, shapes: np.ndarray) -> np.ndarray:
    gram = np.sum(shapes * tower.shapes, axis=0) ** 2
    return np.asarray(gram / np.sum(shapes**2, axis=0) / np.sum(tower.shapes**2, axis=0))


@pytest.mark.property
@pytest.mark.parametrize("missing", [(), (0,), (1, 4)])
def test_completed_shapes_are_orthonormal_to_the_mass(missing: tuple[int, ...]) -> None:
    tower, shapes = _completed(1, missing)
    assert shapes.T @ np.diag(tower.mass) @ shapes == pytest.approx(np.eye(7), abs=1e-9)


@pytest.mark.planted
@pytest.mark.parametrize("missing", [(), (0,), (1, 4)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_weak_mode_follows_from_the_others(seed: int, missing: tuple[int, ...]) -> None:
    # with equal weights eight of these nine are below, the worst at 0.982
    assert _assurance(*_completed(seed, missing)).min() > 0.995


@pytest.mark.property
def test_the_rotation_is_exact_with_one_floor_and_open_in_the_middle_of_four() -> None:
    """Of four floors that follow one another the outer storeys alone show how the motion is divided among them."""
    errors = []
    for missing in ((2,), (1, 4), (1, 2, 3, 4)):
        tower, seen, error, measured = _seen(1, missing)
        errors.append(
            completed_shapes(seen, error, measured, tower.mass, 2.0 * np.pi * tower.frequencies_hz).turn_error
        )
    assert errors[0] == 0.0 and 0.0 < errors[1] < 0.1 < errors[2]
