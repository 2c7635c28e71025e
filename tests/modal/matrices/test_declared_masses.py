"""Declared masses against those of the modes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.matrices.declared_masses import check_declared_masses
from mrpipe.modal.matrices.scaling import Scale, find_scale
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.selection import Layout
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import complex_modes, shear_frame
from tests.modal.rig import Rig, sweep_test

pytestmark = pytest.mark.planted

MASSES = np.array([5.0, 6.0, 5.5, 4.0])
FRAME = shear_frame(MASSES, [5000.0, 6000.0, 5500.0, 4500.0], 0.008)


def _test(floor: int) -> FrameTest:
    return sweep_test(FRAME, np.random.default_rng(2), Rig(noise=0.01, rate=100.0, sweep_s=100.0), shaker_floor=floor)


FORCED, SHAKEN = _test(4), _test(0)


def _fit(test: FrameTest) -> MultiModeFit:
    modes = complex_modes(FRAME)
    return fit_modes([record_spectrum(test, (0.5, 14.0))], modes.angular_frequencies, modes.damping_ratios)


def _check(test: FrameTest, declared: FloatArray) -> tuple[tuple[str, ...], FloatArray]:
    fit, layout = _fit(test), Layout(4, declared)
    tests = FrameTests((test,), (), declared, Path("campaign.yaml"))
    scale = find_scale(fit, tests, layout, IdentificationOptions())[0]
    found = check_declared_masses(fit, layout, scale)
    return found.findings, found.intervals


def _gain(test: FrameTest, floor: int, gain: float) -> FrameTest:
    factors = np.ones(4)
    factors[floor - 1] = gain
    return replace(test, responses=test.responses * factors)


@pytest.mark.parametrize("test", [FORCED, SHAKEN])
def test_right_masses_have_no_finding(test: FrameTest) -> None:
    findings, intervals = _check(test, MASSES)
    assert findings == () and np.all(np.ptp(intervals, axis=1) == 0.0)


@pytest.mark.parametrize("test", [FORCED, SHAKEN])
def test_a_wrong_mass_is_named_with_its_factor(test: FrameTest) -> None:
    declared = MASSES * np.array([1.0, 1.35, 1.0, 1.0])
    [line], intervals = _check(test, declared)
    assert line.startswith("floor 2: ") and "1.35 times the true one" in line
    assert ("reads as the others" in line) == (test is SHAKEN)
    assert intervals[1, 0] < MASSES[1] < intervals[1, 1]


def test_a_common_factor_needs_a_force() -> None:
    [line], intervals = _check(FORCED, 0.8 * MASSES)
    assert "the measured force gives 12" in line and "of all floors" in line
    assert np.all((intervals[:, 0] < MASSES) & (intervals[:, 1] > MASSES))
    assert _check(SHAKEN, 0.8 * MASSES)[0] == ()


def test_ground_motion_separates_the_gain_of_a_sensor_from_a_mass() -> None:
    [line], _ = _check(_gain(SHAKEN, 3, 1.25), MASSES)
    assert line.startswith("floor 3: ") and "because its sensor reads 125 %" in line
    [line], _ = _check(_gain(FORCED, 3, 1.25), MASSES)
    assert line.startswith("floor 3: ") and "or its sensor reads 125 %" in line


def test_unknown_masses_are_not_compared() -> None:
    assert check_declared_masses(_fit(FORCED), Layout(4, None), Scale()).findings == ()
