"""Modes of tests that agree, and delays that a softening structure only seems to have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import no_progress
from mrpipe.modal.agreement import modes_of_tests, of_agreeing_tests, without_weak_clocks
from mrpipe.modal.clocks.delays import SensorClock
from mrpipe.modal.doubts import Doubt
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.selection import Layout
from mrpipe.structures import complex_modes, shear_frame
from tests.modal.rig import Rig, random_frame, sweep_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3)
MASSES = np.diag(FRAME.mass)
LAYOUT = Layout(3, MASSES)
OPTIONS = IdentificationOptions(amplitude_dependence=False)


def _test(name: str, seed: int, factor: float = 1.0) -> FrameTest:
    frame = replace(FRAME, stiffness=factor * FRAME.stiffness)
    return replace(sweep_test(frame, np.random.default_rng(seed), Rig(noise=0.01, rate=100.0, sweep_s=80.0)), name=name)


def _tests(*forced: FrameTest) -> FrameTests:
    return FrameTests(forced, (), MASSES, Path("campaign.yaml"))


def test_tests_that_agree_are_kept() -> None:
    tests = _tests(_test("a", 1), _test("b", 2))
    found = modes_of_tests(tests, LAYOUT, OPTIONS, no_progress)
    assert of_agreeing_tests(found, tests, LAYOUT, OPTIONS, no_progress) is None


def test_a_changed_structure_is_left_out_and_named() -> None:
    tests = _tests(_test("a", 1), _test("b", 2), _test("c", 3, 0.96))
    result = identify_frame(tests, OPTIONS)
    [line] = [item for item in result.doubts if "test c (-2" in item]
    assert "left out of the fit" in line and line in result.findings
    modes = complex_modes(FRAME)
    assert [item.value for item in result.frequencies] == pytest.approx(modes.angular_frequencies, rel=1e-3)
    assert [item.value for item in result.damping] == pytest.approx(modes.damping_ratios, rel=0.05)
    assert not any("does not reproduce" in item or "longer records" in item for item in result.findings)


def test_of_two_tests_that_differ_the_intervals_contain_both() -> None:
    tests = _tests(_test("a", 1), _test("b", 2, 0.97))
    result = identify_frame(tests, OPTIONS)
    assert any("their intervals contain each test" in item for item in result.doubts)
    for factor in (1.0, 0.97):
        for estimate, omega in zip(result.frequencies, complex_modes(FRAME).angular_frequencies, strict=True):
            assert estimate.low * 0.999 <= np.sqrt(factor) * omega <= estimate.high * 1.001


def test_delays_below_the_error_of_laws_over_amplitude_are_left_out() -> None:
    tests = _tests(_test("a", 1), _test("b", 2))
    found = modes_of_tests(tests, LAYOUT, OPTIONS, no_progress)
    sensors = tests.forced[0].sensors
    clocks = (SensorClock("a", sensors[0], 4e-4, 1e-5), SensorClock("b", sensors[1], 0.02, 1e-5))
    found = replace(found, clocks=clocks)
    again = without_weak_clocks(found, 0.1, tests, LAYOUT, OPTIONS, no_progress)
    assert again is not None and again.clocks == clocks[1:]
    # a delay that a sensor has in each test is not a property of one amplitude
    steady = replace(found, clocks=tuple(SensorClock(name, sensors[0], 4e-4, 1e-5) for name in ("a", "b")))
    assert without_weak_clocks(steady, 0.1, tests, LAYOUT, OPTIONS, no_progress) is None


@pytest.mark.parametrize("top", [6.0, 3.0])
def test_exchanged_sensors_are_named_also_where_they_hide_a_mode(top: float) -> None:
    frame = shear_frame([6.0, 6.0, top], [6000.0, 5500.0, 5000.0], 0.01)
    test = sweep_test(frame, np.random.default_rng(1), Rig(noise=0.01, rate=100.0, sweep_s=80.0))
    swapped = replace(test, responses=test.responses[:, [0, 2, 1]])
    result = identify_frame(replace(_tests(swapped), floor_masses=np.diag(frame.mass)), OPTIONS)
    assert any("floors 2 and 3 may be exchanged" in item for item in result.doubts)
    assert result.tridiagonal is None
    right = identify_frame(replace(_tests(test), floor_masses=np.diag(frame.mass)), OPTIONS)
    assert right.tridiagonal is not None and right.doubts == ()


def test_a_doubt_is_a_sentence() -> None:
    assert Doubt("a sensor is late") == "a sensor is late"
