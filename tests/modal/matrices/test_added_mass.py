"""Scale of modes from added masses, and floor masses from the orthogonality of the modes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.matrices.added_mass import modal_scale
from mrpipe.modal.matrices.masses import masses_by_orthogonality
from mrpipe.modal.matrices.scaling import find_scale
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.recordings import frame_tests
from mrpipe.modal.records import FrameTest, FrameTests, Place, Sensor
from mrpipe.modal.search.selection import Layout
from tests.modal.towers import Sensors, Tower, ambient_test, forced_test, random_tower

HERE = Path("planted")
NONE = np.full(4, np.nan)


def heavier(tower, added):
    mass = tower.mass.copy()
    for floor, value in added.items():
        mass[floor - 1] += value
    return Tower(mass, tower.stiffness, tower.damping_ratios)


def exact_fit(tower, floors, factors, error=1e-7):
    """The modes of a tower at some floors, each with a factor of its own."""
    shapes = (tower.shapes * factors)[[floor - 1 for floor in floors]]
    modes = shapes.shape[1]
    sensors = tuple(Sensor(floor, "", False) for floor in floors)
    return MultiModeFit(
        2.0 * np.pi * tower.frequencies_hz, tower.damping_ratios, np.eye(2 * modes) * error**2, shapes.astype(complex),
        np.full(shapes.shape, error), np.ones(shapes.shape), (), (), (), (), np.ones(len(floors)), sensors,
    )  # fmt: skip


@pytest.mark.property
def test_exact_modes_give_the_exact_scale_with_large_masses_on_some_floors():
    rng = np.random.default_rng(3)
    tower = random_tower(rng, floors=4)
    added = {2: 0.3 * tower.mass[1], 4: 0.2 * tower.mass[3]}
    base = exact_fit(tower, (1, 2, 4), rng.uniform(-2.0, 2.0, 4))
    changed = exact_fit(heavier(tower, added), (2, 4), rng.uniform(-2.0, 2.0, 4))
    found = modal_scale(base, [(changed, added)])
    # the shapes of the tower are mass-normalised, so the scale is their squared norm over the sensors
    assert found.values == pytest.approx(np.sum(tower.shapes[[0, 1, 3]] ** 2, axis=0), rel=1e-4)


@pytest.mark.property
def test_exact_shapes_give_the_masses_and_too_few_give_none():
    rng = np.random.default_rng(5)
    tower = random_tower(rng, floors=4)
    unit = tower.shapes / np.linalg.norm(tower.shapes, axis=0)
    scales = np.sum(tower.shapes**2, axis=0)
    scales[2] = np.nan
    small = np.full(4, 1e-4)
    found = masses_by_orthogonality(unit, small, NONE, scales, small)
    assert found is not None
    assert found.masses == pytest.approx(tower.mass, rel=1e-6)
    known = np.array([np.nan, tower.mass[1], np.nan, np.nan])
    nothing = np.full(4, np.nan)
    found = masses_by_orthogonality(unit, small, known, nothing, np.full(4, np.inf))
    assert found is not None
    assert found.masses == pytest.approx(tower.mass, rel=1e-6)
    assert np.all(np.diff(found.intervals, axis=1)[[0, 2, 3]] > 0.0) and np.diff(found.intervals[1]) == 0.0
    assert masses_by_orthogonality(unit, small, NONE, nothing, np.full(4, np.inf)) is None
    assert masses_by_orthogonality(unit[:, :2], small[:2], NONE, scales[:2], small[:2]) is None


def ambient(tower, rng, name, added=None):
    seen = ambient_test(tower, rng, Sensors(noise=0.03), duration_s=2400.0)
    places = tuple(Place(floor) for floor in range(1, tower.floors + 1))
    masses = tuple(sorted((added or {}).items()))
    return FrameTest(name, "ambient", 50.0, None, seen, (False,) * tower.floors, places=places, added_masses=masses)


@pytest.mark.planted
def test_ambient_tests_with_and_without_an_added_mass_give_the_masses():
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    rng = np.random.default_rng(1)
    tower = random_tower(rng, floors=4)
    added = {2: 0.06 * tower.mass[1], 4: 0.06 * tower.mass[3]}
    first, second = ambient(tower, rng, "empty"), ambient(heavier(tower, added), rng, "loaded", added)
    result = identify_frame(FrameTests((), (), NONE, HERE, (first,), (second,)))
    assert result.masses == pytest.approx(tower.mass, rel=0.08)
    low, high = result.mass_intervals.T
    assert np.all((low < tower.mass) & (tower.mass < high))
    assert result.frame is not None
    assert any("from the added masses" in line for line in result.findings)


@pytest.mark.planted
def test_added_masses_check_floor_masses_that_are_wrong():
    rng = np.random.default_rng(2)
    tower = random_tower(rng, floors=3)
    added = {3: 0.1 * tower.mass[2]}

    def shaken(structure, name, masses=()):
        force, seen = forced_test(structure, rng, Sensors(noise=0.02), 3, duration_s=240.0, kind="random")
        places = tuple(Place(floor) for floor in (1, 2, 3))
        return FrameTest(name, "random", 50.0, force, seen, (False,) * 3, 3, places=places, added_masses=masses)

    tests = shaken(tower, "empty"), shaken(heavier(tower, added), "loaded", tuple(added.items()))
    result = identify_frame(FrameTests(tests[:1], (), 1.25 * tower.mass, HERE, (), tests[1:]))
    line = next(line for line in result.findings if "check of the floor masses" in line)
    assert float(line.split("give ")[1].split(" %")[0]) == pytest.approx(80.0, abs=2.0)


@pytest.mark.property
def test_modes_without_force_or_added_mass_have_no_scale():
    tower = random_tower(np.random.default_rng(3), floors=4)
    fit = exact_fit(tower, (1, 2, 3, 4), np.ones(4))
    tests = FrameTests((), (), NONE, HERE)
    scale, findings = find_scale(fit, tests, Layout(4, None), IdentificationOptions())
    assert scale.residues is None and scale.floor == 0 and findings == []


def campaign(details):
    rng = np.random.default_rng(0)
    time = np.arange(2000) / 50.0

    def recording(name, own):
        channels = {f"floor_acceleration_{floor}": rng.standard_normal(2000) for floor in (1, 3)}
        return Recording(name, "training", 50.0, time, channels, (), "ambient", own)

    tests = tuple(recording(f"test {i}", own) for i, own in enumerate(details))
    return Campaign("planted", "shear-frame", HERE, tests)


@pytest.mark.property
@pytest.mark.parametrize(
    ("details", "words"),
    [
        (({"added_masses_kg": {3: 10.0}},), "all tests have added masses"),
        (({}, {"added_masses_kg": {2: 10.0}}), "floor 2 has no sensor"),
        (({}, {"added_masses_kg": {4: 10.0}}), "names floor 4"),
    ],
)
def test_wrong_added_masses_are_named_in_one_line(details, words):
    with pytest.raises(UserError, match=words) as caught:
        frame_tests(campaign(details))
    assert "added_masses_kg" in str(caught.value) and "\n" not in str(caught.value)
