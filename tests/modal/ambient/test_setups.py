"""Ambient set-ups: sensors that move, with some that stay, give one set of shapes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.modal.ambient.setups import SetUp, confirmed, merge_set_ups
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.records import FrameTest, FrameTests, Place, Sensor
from tests.modal.ambient.test_modes import assert_modes
from tests.modal.towers import Sensors, ambient_test, random_tower

HERE = Path("planted")


def record(tower, rng, floors, name):
    seen = ambient_test(tower, rng, Sensors(noise=0.03), duration_s=1500.0)
    places = tuple(Place(floor) for floor in floors)
    columns = [floor - 1 for floor in floors]
    return FrameTest(name, "ambient", 50.0, None, seen[:, columns], (False,) * len(floors), places=places)


@pytest.fixture(scope="module")
def roving():
    rng = np.random.default_rng(8)
    tower = random_tower(rng, floors=5)
    return tower, (record(tower, rng, (1, 2, 5), "lower"), record(tower, rng, (2, 3, 4, 5), "upper"))


@pytest.mark.planted
def test_two_set_ups_give_all_modes_at_all_floors(roving):
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower, tests = roving
    result = identify_frame(FrameTests((), (), tower.mass, HERE, tests))
    assert result.mode_shapes.shape == (5, 5)
    assert_modes(result, tower)
    assert result.frame is not None
    largest = np.abs(tower.stiffness).max()
    assert result.frame.stiffness == pytest.approx(tower.stiffness, abs=0.05 * largest)


@pytest.mark.planted
def test_modes_that_two_sensors_see_alike_are_kept():
    """Two sensors can see neighbouring modes with the same ratio: the second was taken for a copy of the first."""
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    rng = np.random.default_rng(28)
    tower = random_tower(rng, floors=5)
    tests = [record(tower, rng, (floor, 5), f"floor {floor}") for floor in (1, 2, 3, 4)]
    result = identify_frame(FrameTests((), (), tower.mass, HERE, tuple(tests)))
    assert_modes(result, tower)


@pytest.mark.planted
def test_set_ups_without_a_common_sensor_are_refused_in_one_line(roving):
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower, (first, second) = roving
    apart = replace(second, responses=second.responses[:, 1:3], is_displacement=(False,) * 2, places=second.places[1:3])
    with pytest.raises(UserError, match=r"tests\.upper.*no sensor in common.*reference") as caught:
        identify_frame(FrameTests((), (), tower.mass, HERE, (first, apart)))
    assert "\n" not in str(caught.value)


def fit_of(sensors, shapes, omega, error=0.01):
    modes = len(omega)
    values = np.array(shapes, dtype=complex)
    empty = ()
    fit = MultiModeFit(
        np.array(omega), np.full(modes, 0.01), np.eye(2 * modes) * 1e-6, values, np.full(values.shape, error),
        np.ones(values.shape), empty, empty, (), empty, np.ones(len(sensors)), sensors,
    )  # fmt: skip
    inputs = np.full((len(sensors), 1, modes), np.nan, dtype=complex)
    return replace(fit, participations=np.ones((1, modes), dtype=complex), input_residues=inputs)


@pytest.mark.property
def test_a_doubtful_pole_is_kept_where_another_set_up_shows_it():
    top, low, high = (Sensor(floor, "", False) for floor in (5, 1, 2))
    responses = np.random.default_rng(1).standard_normal((500, 2))
    tests = (FrameTest("a", "ambient", 50.0, None, responses, (False,) * 2),)
    shapes = [[0.5, 0.6, 0.6], [1.0, 1.0, 1.0]]
    # the second pole is a mode that the two sensors see as they see the third; the first is split from the second
    one = SetUp(tests, fit_of((low, top), shapes, [38.0, 40.0, 43.0]), (True, True, False))
    other = SetUp(tests, fit_of((high, top), [row[1:] for row in shapes], [40.1, 43.1]), (True, False))
    kept = [item.fit.angular_frequencies.tolist() for item in confirmed((one, other))]
    assert kept == [[40.0, 43.0], [40.1, 43.1]]


@pytest.mark.property
def test_scale_and_sign_of_a_set_up_follow_from_the_shared_sensors():
    floors = [Sensor(floor, "", False) for floor in (1, 2, 3, 4)]
    exact = np.array([[0.3, -1.0], [0.6, -0.4], [0.8, 0.5], [1.0, 0.9]])
    responses = np.random.default_rng(1).standard_normal((500, 3))
    tests = (FrameTest("a", "ambient", 50.0, None, responses, (False,) * 3),)
    first = SetUp(tests, fit_of((floors[0], floors[1], floors[3]), exact[[0, 1, 3]], [10.0, 30.0]))
    second = SetUp(tests, fit_of((floors[1], floors[2], floors[3]), exact[1:] * [-2.5, 0.1], [10.05, 29.9]))
    merged = merge_set_ups((first, second), HERE)
    assert merged.fit.sensors == tuple(floors)
    assert merged.fit.residues.real == pytest.approx(exact, rel=1e-9)
    assert merged.places == ((0, 1), (0, 1))
