"""Ambient tests: modes without a measured excitation."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.errors import UserError
from mrpipe.modal.ambient.refine import two_peaks
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests, Place
from mrpipe.modal.storage import summary, write_identification
from mrpipe.structures import read_frame
from tests.modal.towers import FINE, Sensors, Tower, ambient_test, random_tower, respond, sample

HERE = Path("planted")


@pytest.fixture(scope="module")
def tower_and_test():
    rng = np.random.default_rng(11)
    tower = random_tower(rng, floors=4)
    seen = ambient_test(tower, rng, Sensors(noise=0.03), duration_s=1800.0)
    places = tuple(Place(floor) for floor in range(1, 5))
    return tower, FrameTest("wind", "ambient", 50.0, None, seen, (False,) * 4, places=places)


def assurance(first, second):
    return np.abs(first @ second) ** 2 / (first @ first) / (second @ second)


def assert_modes(result, tower):
    frequency = np.array([item.value for item in result.frequencies]) / (2 * np.pi)
    ratios = np.array([item.value for item in result.damping])
    assert frequency == pytest.approx(tower.frequencies_hz, rel=0.01)
    assert ratios == pytest.approx(tower.damping_ratios, rel=0.25)
    assert min(assurance(a, b) for a, b in zip(result.mode_shapes.T, tower.shapes.T, strict=True)) > 0.97


@pytest.mark.planted
def test_all_modes_are_found_and_none_invented(tower_and_test):
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower, test = tower_and_test
    result = identify_frame(FrameTests((), (), tower.mass, HERE, (test,)))
    assert_modes(result, tower)
    inside = [item.low < truth < item.high for item, truth in zip(result.damping, tower.damping_ratios, strict=True)]
    assert sum(inside) >= 3
    assert any("modal masses and participations cannot be determined" in line for line in result.findings)
    values = summary(result)
    assert values["coherence_at_peaks"] == [None] * 4
    assert np.array(values["stiffness"]) == pytest.approx(tower.stiffness, abs=0.05 * np.abs(tower.stiffness).max())


@pytest.mark.planted
def test_the_polyreference_estimator_finds_the_same_modes(tower_and_test):
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower, test = tower_and_test
    assert_modes(
        identify_frame(FrameTests((), (), tower.mass, HERE, (test,)), IdentificationOptions(ambient_method="plscf")),
        tower,
    )


@pytest.mark.planted
def test_without_masses_only_modes_are_given(tower_and_test, tmp_path):
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower, test = tower_and_test
    result = identify_frame(FrameTests((), (), np.full(4, np.nan), HERE, (test,)))
    assert_modes(result, tower)
    assert result.frame is None
    assert summary(result)["mass"] is None
    path = tmp_path / "frame.h5"
    with ArtifactWriter.create(path, Provenance("identify-frame")) as artifact:
        write_identification(artifact, result)
    with pytest.raises(UserError, match="modes but no matrices"):
        read_frame(Artifact(path))


@pytest.mark.property
def test_a_missing_library_is_named(tower_and_test, monkeypatch):
    tower, test = tower_and_test
    monkeypatch.setitem(sys.modules, "pyoma2", None)
    with pytest.raises(UserError, match=r"pip install 'mrpipe\[ambient\]'"):
        identify_frame(FrameTests((), (), tower.mass, HERE, (test,)))


@pytest.mark.planted
def test_a_soft_storey_does_not_put_the_highest_mode_outside_the_band():
    """On soft bearings the second mode lies at 18 times the first one, beyond the spread of a chain of like floors."""
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    mass, bearings, storey = 1e4, 2e4 * (2 * np.pi * 1.0) ** 2, 5e3 * (2 * np.pi * 18.0) ** 2
    stiffness = np.array([[bearings + storey, -storey], [-storey, storey]])
    tower = Tower(np.full(2, mass), stiffness, np.array([0.02, 0.01]))
    seen = ambient_test(tower, np.random.default_rng(3), Sensors(noise=0.01), duration_s=900.0)
    wind = FrameTest("wind", "ambient", 50.0, None, seen, (False,) * 2, places=(Place(1), Place(2)))
    result = identify_frame(FrameTests((), (), tower.mass, HERE, (wind,)))
    found = [item.value / (2 * np.pi) for item in result.frequencies]
    assert found == pytest.approx(tower.frequencies_hz, rel=0.01)


@pytest.mark.property
def test_a_record_too_short_for_its_lowest_peak_is_refused_in_one_line(recwarn):
    """One sensor of a building for 109 s, with a drift: warnings and a traceback of pyOMA2."""
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    rng = np.random.default_rng(3)
    drift = np.sin(2 * np.pi * 0.08 * np.arange(20000) / 200.0)
    seen = (drift + 0.01 * rng.standard_normal(20000))[:, None]
    test = FrameTest("real", "ambient", 200.0, None, seen, (False,), places=(Place(1),))
    with pytest.raises(UserError, match=r"tests.real: lasts 100 s; the lowest peak .* needs at least 1[0-9][0-9] s"):
        identify_frame(FrameTests((), (), np.array([np.nan]), HERE, (test,)))
    assert not recwarn.list


@pytest.mark.planted
def test_a_record_of_25_s_is_divided_into_fewer_blocks():
    """Eight blocks were shorter than the correlation functions, and pyOMA2 divided by zero."""
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower = random_tower(np.random.default_rng(4), floors=3)
    seen = ambient_test(tower, np.random.default_rng(5), Sensors(noise=0.02), duration_s=25.0)
    test = FrameTest("wind", "ambient", 50.0, None, seen, (False,) * 3, places=tuple(Place(i) for i in (1, 2, 3)))
    result = identify_frame(FrameTests((), (), tower.mass, HERE, (test,)))
    found = [item.value / (2 * np.pi) for item in result.frequencies]
    assert found == pytest.approx(tower.frequencies_hz, rel=0.02)


@pytest.fixture(scope="module")
def tower_with_mast():
    """Three heavy floors and a light mast that is tuned to their first mode: a close pair that only the mast shows."""
    mass, springs = np.array([40e3, 40e3, 36e3, 60.0]), np.array([6e7, 5.5e7, 5e7])
    stiffness = np.zeros((4, 4))
    stiffness[:3, :3] = (
        np.diag(springs + np.append(springs[1:], 0.0)) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    )
    first = float(np.linalg.eigvals(stiffness[:3, :3] / mass[:3, None]).real.min())
    stiffness[2:, 2:] += 60.0 * 1.006 * first * np.array([[1.0, -1.0], [-1.0, 1.0]])
    tower = Tower(mass, stiffness, np.array([0.007, 0.007, 0.01, 0.01]))
    rng = np.random.default_rng(8)
    forces = 200.0 * rng.standard_normal((round(1800.0 * 40.0 * FINE), 4)) * [1.0, 1.0, 1.0, 0.01]
    low = sosfiltfilt(butter(4, 16.0, fs=40.0 * FINE, output="sos"), forces, axis=0)
    responses = respond(tower, low, 1.0 / (40.0 * FINE))
    seen = sample(tower, rng, Sensors(noise=0.01), responses, low[:, 0], 40.0)[1]
    return tower, FrameTest("wind", "ambient", 40.0, None, seen, (False,) * 4, places=tuple(map(Place, range(1, 5))))


@pytest.mark.planted
@pytest.mark.parametrize("known", [True, False])
def test_a_light_mast_does_not_merge_two_close_modes(tower_with_mast, known):
    """Their shapes are alike without the mass; they had been one mode between the two, with a fifth of the damping."""
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower, test = tower_with_mast
    result = identify_frame(FrameTests((), (), tower.mass if known else np.full(4, np.nan), HERE, (test,)))
    found = [item.value / (2 * np.pi) for item in result.frequencies]
    assert found == pytest.approx(tower.frequencies_hz, rel=0.003)
    assert [item.value for item in result.damping] == pytest.approx(tower.damping_ratios, rel=0.25)


@pytest.mark.planted
def test_the_spectra_of_one_mode_have_no_second_peak(tower_and_test):
    tower, test = tower_and_test
    omega, ratio = 2 * np.pi * tower.frequencies_hz[1], tower.damping_ratios[1]
    for apart in (0.96, 1.04):
        assert not two_peaks([test], [], (apart * omega, ratio), (omega, ratio))


@pytest.mark.planted
def test_a_neighbouring_mode_is_no_second_peak(tower_and_test):
    """A false pole near a mode had stood for the flank of the next mode, which lies in the same band."""
    tower, test = tower_and_test
    modes = list(zip(2 * np.pi * tower.frequencies_hz, tower.damping_ratios, strict=True))
    (low, _), high = modes[2], modes[3]
    false = (high[0] - 0.5 * (high[0] - low), 0.014)
    assert not two_peaks([test], [*modes, false], false, high)
