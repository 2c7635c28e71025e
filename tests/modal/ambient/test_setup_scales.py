"""Set-ups whose reference sensor stands at the node of a mode: orthogonality gives the scale, or nothing does."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.ambient.setup_scales import Part, joined_parts, scaled_by_orthogonality, scaling_notes
from mrpipe.modal.ambient.setups import SetUp, merge_set_ups
from mrpipe.modal.records import FrameTest, Sensor
from mrpipe.modal.search.selection import Layout
from tests.modal.ambient.test_setups import HERE, fit_of
from tests.modal.towers import random_tower

MODE = 3


def parts_of(tower, groups, error, rng):
    """The mode at the floors of each group, in a scale of its own, with an error relative to the mean element."""
    size = error * np.sqrt(np.mean(tower.shapes[:, MODE] ** 2))
    found = []
    for rows in groups:
        scale = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-1.0, 1.0)
        values = tower.shapes[list(rows), MODE] + size * rng.standard_normal(len(rows))
        found.append(Part(tuple(rows), scale * values, np.full(len(rows), abs(scale) * size)))
    return found


def without_mode(tower, error, rng):
    shapes = np.delete(tower.shapes, MODE, axis=1)
    spread = error * np.sqrt(np.mean(shapes**2, axis=0)) * np.ones(shapes.shape)
    return shapes + spread * rng.standard_normal(shapes.shape), spread


def relative_error(values, tower):
    true = tower.shapes[:, MODE] / np.linalg.norm(tower.shapes[:, MODE])
    unit = values / np.linalg.norm(values)
    return np.linalg.norm(unit * np.sign(unit @ true) - true)


@pytest.mark.property
@pytest.mark.parametrize("groups", [((0, 1, 2), (3, 4, 5, 6)), ((0, 1, 3), (2, 5), (4, 6))])
def test_parts_without_a_common_row_get_their_scale_from_the_other_modes(groups):
    rng = np.random.default_rng(1)
    tower = random_tower(rng, 7)
    values, errors = joined_parts(parts_of(tower, groups, 1e-6, rng), *without_mode(tower, 1e-6, rng), tower.mass)
    assert relative_error(values, tower) < 1e-4
    # what sensors pick up of other floors is allowed for
    assert 0.005 < np.linalg.norm(errors) / np.linalg.norm(values) < 0.1


@pytest.mark.planted
def test_the_stated_errors_hold_the_truth():
    """Of 60 shapes with 2 % noise the error is within twice the stated one in 95 of a hundred."""
    inside = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        tower = random_tower(rng, 7)
        found = joined_parts(
            parts_of(tower, ((0, 1, 3), (2, 5), (4, 6)), 0.02, rng), *without_mode(tower, 0.02, rng), tower.mass
        )
        assert found is not None
        values, errors = found
        inside.append(relative_error(values, tower) < 2.0 * np.linalg.norm(errors) / np.linalg.norm(values))
    assert np.mean(inside) > 0.9


@pytest.mark.property
def test_too_few_modes_leave_the_scale_open():
    rng = np.random.default_rng(1)
    tower = random_tower(rng, 7)
    shapes, errors = without_mode(tower, 1e-6, rng)
    parts = parts_of(tower, ((0, 1), (2, 5), (4, 6), (3,)), 1e-6, rng)
    assert joined_parts(parts, shapes[:, :2], errors[:, :2], tower.mass) is None
    assert joined_parts(parts[:3], shapes, errors, tower.mass) is None  # floor 4 has no sensor


def tower_with_node():
    """A tower, and a floor (from 0) that is a node of the mode."""
    rng = np.random.default_rng(5)
    while True:
        tower = random_tower(rng, 7)
        size = np.abs(tower.shapes[:, MODE]) / np.abs(tower.shapes[:, MODE]).max()
        if size.min() < 0.005:
            return tower, int(np.argmin(size))


def merged_with_node(tower, node, masses_known=True):
    """Two set-ups that share the floor of the node, where noise has opposite signs in them."""
    rest = [row for row in range(7) if row != node]
    omega = 2.0 * np.pi * tower.frequencies_hz
    responses = np.random.default_rng(1).standard_normal((500, 4))
    set_ups = []
    for own, turn in ((rest[:3], 1.0), (rest[3:], -1.0)):
        rows = sorted([*own, node])
        shapes = tower.shapes[rows] / np.sqrt(np.mean(tower.shapes**2, axis=0))
        shapes[rows.index(node), MODE] = 0.01 * turn
        sensors = tuple(Sensor(row + 1, "", False) for row in rows)
        test = FrameTest("a", "ambient", 50.0, None, responses, (False,) * 4)
        set_ups.append(SetUp((test,), fit_of(sensors, shapes, omega, 0.002)))
    merged = merge_set_ups(set_ups, HERE)
    layout = Layout(7, tower.mass if masses_known else None)
    return merged, scaled_by_orthogonality(merged, [mode for mode in range(7) if mode != MODE], layout)


@pytest.mark.planted
def test_a_mode_whose_node_is_at_the_reference_sensor_gets_its_shape():
    tower, node = tower_with_node()
    merged, found = merged_with_node(tower, node)
    wrong, right = (relative_error(fit.residues[:, MODE].real, tower) for fit in (merged.fit, found))
    assert wrong > 0.5 and right < 0.05
    stated = np.linalg.norm(merged.fit.residue_errors[:, MODE]) / np.linalg.norm(merged.fit.residues[:, MODE])
    assert stated > 0.35
    assert "near a node of mode 4;" in scaling_notes(merged.fit, found, range(7))[0]


@pytest.mark.property
def test_without_masses_the_shapes_stay_as_they_were_merged():
    merged, found = merged_with_node(*tower_with_node(), masses_known=False)
    assert found is merged.fit
