"""Lines of machines in ambient records."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from mrpipe.modal.ambient.harmonics import chance, harmonic_findings, without_harmonics
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.records import FrameTest, FrameTests, Place
from tests.modal.towers import Sensors, Tower, ambient_test, random_tower

RATE = 50.0


def wind_test(tower, rng, duration_s):
    seen = ambient_test(tower, rng, Sensors(noise=0.02), rate=RATE, duration_s=duration_s)
    places = tuple(Place(floor) for floor in range(1, tower.floors + 1))
    return FrameTest("wind", "ambient", RATE, None, seen, (False,) * tower.floors, places=places)


def with_machine(test, frequency_hz, sizes):
    clock = np.arange(test.responses.shape[0]) / RATE
    wave = np.sin(2 * np.pi * frequency_hz * clock + 0.3)[:, None] * np.asarray(sizes)
    return replace(test, responses=test.responses + wave)


@pytest.mark.planted
def test_a_machine_near_a_mode_is_removed_and_named():
    """The second mode had been found at 4.836 Hz with a third of its damping; the machine runs at 4.851 Hz."""
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    tower = random_tower(np.random.default_rng(2), floors=3, damping=(0.01, 0.012))
    quiet = wind_test(tower, np.random.default_rng(3), 900.0)
    machine = 1.012 * tower.frequencies_hz[1]
    loud = with_machine(
        quiet, machine, 1.5 * quiet.responses.std() * tower.shapes[:, 1] / np.abs(tower.shapes[:, 1]).max()
    )
    cleaned, lines = without_harmonics([loud], 0.2)
    assert [line.frequency_hz for line in lines] == pytest.approx([machine], abs=1e-4)
    assert np.std(cleaned[0].responses - quiet.responses) < 0.1 * quiet.responses.std()
    result = identify_frame(FrameTests((), (), tower.mass, Path("planted"), (loud,)))
    assert result.frequencies[1].value / (2 * np.pi) == pytest.approx(tower.frequencies_hz[1], rel=0.004)
    assert result.damping[1].value == pytest.approx(tower.damping_ratios[1], rel=0.25)
    assert any(f"test wind: a harmonic of {machine:.5g} Hz" in line for line in result.findings)


@pytest.mark.planted
@pytest.mark.parametrize("ratio", [0.003, 0.001])
def test_a_lightly_damped_mode_is_not_a_harmonic(ratio):
    mass, spring = np.full(2, 12.0), 3e4
    tower = Tower(mass, spring * np.array([[2.0, -1.0], [-1.0, 1.0]]), np.full(2, ratio))
    for seed in range(4):
        test = wind_test(tower, np.random.default_rng(seed), 600.0)
        cleaned, lines = without_harmonics([test], 0.2)
        assert not lines
        assert cleaned[0] is test


@pytest.mark.property
def test_the_probability_is_that_of_simulated_modes():
    segments, points, decay = 5, 200, 2.0
    rng = np.random.default_rng(0)
    keep = np.exp(-decay / points)
    white = rng.standard_normal((4000, segments * points)) + 1j * rng.standard_normal((4000, segments * points))
    white[:, 1:] *= np.sqrt(1.0 - keep**2)
    mode = lfilter([1.0], [1.0, -keep], white, axis=1).reshape(4000, segments, points)
    amplitudes = mode @ np.sin(np.pi * (np.arange(points) + 0.5) / points)
    share = np.abs(amplitudes.sum(axis=1)) ** 2 / np.sum(np.abs(amplitudes) ** 2, axis=1) / segments
    for limit in (0.4, 0.7):
        expected = chance(limit, segments, decay)
        assert np.mean(share > limit) == pytest.approx(expected, abs=4.0 * np.sqrt(expected / 4000))


@pytest.mark.property
def test_several_lines_are_named_in_one_sentence():
    rng = np.random.default_rng(5)
    noise = FrameTest("hall", "ambient", RATE, None, rng.standard_normal((40000, 2)), (False,) * 2)
    test = with_machine(with_machine(noise, 12.5, [0.3, 0.1]), 4.003, [0.2, 0.2])
    _, lines = without_harmonics([test], 0.2)
    (finding,) = harmonic_findings(lines)
    assert finding.startswith("test hall: harmonics of 4.003, 12.5 Hz, probably of a machine or of the mains, were")
