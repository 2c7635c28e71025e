"""Two axes and torsion: floors as rigid plates, with close modes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.campaigns import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.matrices.rigid_floors import (
    RigidShapes,
    assemble_rigid,
    ground_influence,
    measured_rows,
    rigid_response,
)
from mrpipe.modal.recordings import frame_tests
from mrpipe.modal.records import FrameTest, FrameTests, Place
from mrpipe.modal.storage import summary, write_identification
from mrpipe.modal.verification import compare_in_time
from mrpipe.structures import Frame, modal_damping_matrix, read_frame
from tests.modal.towers import Sensors as Instruments
from tests.modal.towers import Tower, respond, sample

HERE = Path("planted")
POSITIONS = {"x": (0.0, 4.0), "y1": (-8.0, 0.0), "y2": (8.0, 0.0)}
MASSES, INERTIAS = np.array([90e3, 80e3]), np.array([6e6, 5e6])


def building():
    """Two floors on four columns that are not symmetric: x and y modes within 6 %, coupled with torsion."""
    columns = [(-9.0, -6.0, 1.0, 1.02), (9.0, -6.0, 1.3, 1.05), (-9.0, 6.0, 0.9, 1.0), (9.0, 6.0, 1.0, 1.2)]
    storey = np.zeros((3, 3))
    for px, py, kx, ky in columns:
        for row, k in (((1.0, 0.0, -py), kx), ((0.0, 1.0, px), ky)):
            storey += 6e6 * k * np.outer(row, row)
    stiffness = np.block([[1.9 * storey, -0.9 * storey], [-0.9 * storey, 0.9 * storey]])
    mass = np.column_stack([MASSES, MASSES, INERTIAS]).ravel()
    return Tower(mass, stiffness, np.array([0.012, 0.015, 0.01, 0.014, 0.011, 0.013]))


def rows():
    """What each sensor measures, floor by floor in the order of its directions, shape (6, 6)."""
    found = np.zeros((6, 6))
    for floor in range(2):
        for index, (name, (px, py)) in enumerate(POSITIONS.items()):
            motion = (1.0, 0.0, -py) if name.startswith("x") else (0.0, 1.0, px)
            found[3 * floor + index, 3 * floor : 3 * floor + 3] = motion
    return found


def ambient(tower, rng, rate=40.0, duration_s=2400.0):
    dt = 1.0 / (4 * rate)
    force = rng.standard_normal((int(duration_s / dt), 6)) * np.array([1.0, 1.0, 6.0, 1.0, 1.0, 6.0]) * 300.0
    motion = respond(tower, force, dt) @ rows().T
    places = tuple(Place(floor, name) for floor in (1, 2) for name in POSITIONS)
    seen = sample(tower, rng, Instruments(noise=0.02), motion, force[:, 0], rate)[1]
    return FrameTest("wind", "ambient", rate, None, seen, (False,) * 6, places=places)


@pytest.fixture(scope="module")
def identified():
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower = building()
    test = ambient(tower, np.random.default_rng(1))
    tests = FrameTests((), (), MASSES, HERE, (test,), positions=POSITIONS, inertias=INERTIAS)
    return tower, identify_frame(tests)


@pytest.mark.planted
def test_close_modes_in_two_axes_with_torsion_give_modes_and_matrices(identified, tmp_path):
    tower, result = identified
    gaps = np.diff(np.log(tower.frequencies_hz))
    assert gaps.min() < 0.06
    frequency = np.array([item.value for item in result.frequencies]) / (2.0 * np.pi)
    assert frequency == pytest.approx(tower.frequencies_hz, rel=0.01)
    root = np.sqrt(tower.mass)[:, None]
    for mode in range(6):
        # rotations and translations have different units: the mass makes them comparable
        first, second = (root[:, 0] * shape[:, mode] for shape in (result.mode_shapes, tower.shapes))
        assert (first @ second) ** 2 / (first @ first) / (second @ second) > 0.97
    assert result.degrees_of_freedom[:3] == ("floor 1 x", "floor 1 y", "floor 1 rotation")
    scaled = result.frame.stiffness / root / root.T
    truth = tower.stiffness / root / root.T
    assert np.abs(scaled - truth).max() < 0.05 * np.abs(truth).max()
    assert summary(result)["degrees_of_freedom"][-1] == "floor 2 rotation"
    assert np.shape(summary(result)["mode_shape_errors"]) == np.shape(summary(result)["mode_shapes"])
    path = tmp_path / "frame.h5"
    with ArtifactWriter.create(path, Provenance("identify-frame")) as artifact:
        write_identification(artifact, result)
    frame = read_frame(Artifact(path))
    assert frame.ground_influence.tolist() == [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]


@pytest.mark.planted
@pytest.mark.parametrize("direction", ["x", "y2"])
def test_a_frame_with_torsion_is_simulated_under_a_shaker_and_a_moving_ground(direction):
    """Against the independent integration of the towers: a shaker beside the centre of floor 2, and ground motion."""
    tower, rate = building(), 40.0
    dt = 1.0 / (4 * rate)
    rng = np.random.default_rng(4)
    force = 2000.0 * np.interp(np.arange(8000) * dt, np.arange(1000) * 8 * dt, rng.standard_normal(1000))
    damping = modal_damping_matrix(np.diag(tower.mass), tower.stiffness, tower.damping_ratios)
    frame = Frame(np.diag(tower.mass), damping, tower.stiffness, "truth", np.tile([1.0, 0.0, 0.0], 2))
    places = tuple(Place(floor, name) for floor in (1, 2) for name in POSITIONS)
    assert measured_rows(places, POSITIONS, 2) == pytest.approx(rows())
    lever = measured_rows([(2, direction)], POSITIONS, 2)[0]
    shaken = respond(tower, np.outer(force, lever), dt) @ rows().T
    test = FrameTest(
        "a", "random", 4 * rate, force - force.mean(), shaken, (False,) * 6, 2, direction=direction, places=places
    )
    # a ground acceleration is a force of mass times acceleration, and the ground's own acceleration is added
    axis = ground_influence(2, direction)
    ground = 1e-3 * force
    moved = (respond(tower, -np.outer(ground, axis * tower.mass), dt) + np.outer(ground, axis)) @ rows().T
    base = FrameTest(
        "b", "random", 4 * rate, ground - ground.mean(), moved, (False,) * 6, 0, direction=direction, places=places
    )
    for each in (test, base):
        found = compare_in_time(rigid_response(frame, each, POSITIONS, 8.0), each, (0.3, 8.0))
        assert found.fit_percent.min() > 98.0


def campaign(declared):
    rng = np.random.default_rng(0)
    time = np.arange(2000) / 40.0
    channels = {f"floor_acceleration_1_{name}": rng.standard_normal(2000) for name in ("x", "y1", "y2")}
    test = Recording("wind", "training", 40.0, time, channels, (), "ambient")
    return Campaign("planted", "shear-frame", HERE, (test,), floor_masses_kg=(5.0,), declared={"frame": declared})


@pytest.mark.property
@pytest.mark.parametrize(
    ("declared", "words"),
    [
        ({"sensor_positions_m": {"x": [0, 0], "y1": [1, 0]}}, "has no entry 'y2'"),
        ({"floor_inertias_kg_m2": [1.0, 2.0]}, "has 2 entries"),
    ],
)
def test_wrong_plans_are_named_in_one_line(declared, words):
    with pytest.raises(UserError, match=words) as caught:
        frame_tests(campaign(declared))
    assert "\n" not in str(caught.value)


@pytest.mark.planted
def test_sensors_that_do_not_show_the_rotation_are_refused(identified):
    tower, _ = identified
    test = ambient(tower, np.random.default_rng(2), duration_s=600.0)
    same = {"x": (0.0, 4.0), "y1": (8.0, 0.0), "y2": (8.0, 0.0)}
    with pytest.raises(UserError, match="floor 1 do not determine"):
        identify_frame(FrameTests((), (), MASSES, HERE, (test,), positions=same, inertias=INERTIAS))


@pytest.mark.property
def test_more_modes_than_rigid_floors_have_leave_the_matrices_out():
    rigid = RigidShapes(np.eye(3, 4) + 0.1, np.full((3, 4), 0.01), ("x", "y", "rotation"), np.zeros(4))
    found = assemble_rigid(None, rigid, np.full(4, 0.01), np.array([5.0]), np.array([2.0]), "x")
    assert found.frame is None
    assert "4 modes were found, and 1 rigid floors have 3" in found.findings[-1]
