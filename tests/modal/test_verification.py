"""Forced tests that the identified structure does not reproduce, and what explains them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.records import FrameTest
from mrpipe.modal.verification import misfit_findings, verify_in_time
from mrpipe.structures import shear_frame
from tests.modal.rig import Rig, sweep_test

pytestmark = pytest.mark.planted

FRAME = shear_frame([5.0, 6.0, 5.0, 4.0], [5000.0, 6000.0, 5500.0, 4500.0], 0.008)
BAND = (0.5, 13.0)
# the excitation of the rig is a straight line between samples, which is a band-limited signal at a high rate only
RIG = Rig(sweep_s=60.0, rate=500.0)


def shaken(floor: int) -> FrameTest:
    return sweep_test(FRAME, np.random.default_rng(1), RIG, shaker_floor=floor)


def findings(test: FrameTest) -> list[str]:
    return misfit_findings(FRAME, [test], [verify_in_time(FRAME, test, BAND)], BAND)


@pytest.mark.parametrize("floor", [0, 4])
def test_a_test_without_a_mistake_has_no_finding(floor: int) -> None:
    assert findings(shaken(floor)) == []


@pytest.mark.parametrize("floor", [0, 3])
def test_sign_and_unit_of_the_excitation(floor: int) -> None:
    test = shaken(floor)
    assert test.excitation is not None
    [line] = findings(replace(test, excitation=-test.excitation))
    assert "opposite to the simulated one" in line
    [line] = findings(replace(test, excitation=9.81 * test.excitation))
    assert "is 0.102 times the simulated one" in line


def test_the_floor_of_the_shaker() -> None:
    [line] = findings(replace(shaken(4), shaker_floor=2))
    assert "that to a force on floor 4, and the campaign says floor 2" in line


def test_what_nothing_explains_is_told_without_a_cause() -> None:
    test = shaken(0)
    other = np.random.default_rng(2).permutation(test.responses.shape[0])
    [line] = findings(replace(test, responses=50.0 * test.responses[other]))
    assert "does not reproduce" in line


def test_a_part_of_a_recording_is_simulated_from_its_first_motion() -> None:
    test = shaken(0)
    assert test.excitation is not None
    # mode 1 is at its resonance there
    cut = slice(int(0.12 * test.responses.shape[0]), None)
    part = replace(test, excitation=test.excitation[cut], responses=test.responses[cut])
    from_rest = verify_in_time(FRAME, part, BAND).fit_percent
    settled = verify_in_time(FRAME, replace(part, is_part=True), BAND).fit_percent
    assert from_rest.min() < 80.0 and settled.min() > 90.0
