"""The identified structure against its forced tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import no_progress
from mrpipe.modal.comparison import compare_with_tests
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTests
from mrpipe.modal.search.chosen_tests import ChosenTests, choose_tests
from mrpipe.modal.search.selection import Layout
from mrpipe.structures import Frame
from tests.modal.rig import Rig, random_frame, sweep_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3)
OPTIONS = IdentificationOptions()


@pytest.fixture(scope="module")
def chosen() -> ChosenTests:
    test = sweep_test(FRAME, np.random.default_rng(1), Rig(noise=0.01, rate=100.0, sweep_s=80.0))
    masses = np.diag(FRAME.mass)
    tests = FrameTests((test,), (), masses, Path("campaign.yaml"))
    return choose_tests((test,), tests, Layout(3, masses), OPTIONS)[0]


def test_the_true_structure_predicts_its_test_and_another_one_does_not(chosen: ChosenTests) -> None:
    right, findings = compare_with_tests(FRAME, chosen.tests, chosen, None, OPTIONS, no_progress)
    assert right.in_time[0].fit_percent.min() > 95.0 and not findings
    assert right.in_frequency is not None and right.amplitude is None and right.amplitude_in_time == ()
    softer = replace(FRAME, stiffness=0.9 * FRAME.stiffness)
    wrong, findings = compare_with_tests(softer, chosen.tests, chosen, None, OPTIONS, no_progress)
    assert wrong.in_time[0].fit_percent.max() < 50.0 and findings


@pytest.mark.parametrize("frame", [FRAME, None])
def test_without_forced_tests_or_matrices_nothing_is_compared(chosen: ChosenTests, frame: Frame | None) -> None:
    shown = () if frame is not None else chosen.tests
    result, findings = compare_with_tests(frame, shown, chosen, None, OPTIONS, no_progress)
    assert result.tests == shown and result.in_time == () and result.in_frequency is None and not findings


def test_clipped_tests_and_tests_of_another_state_say_nothing_of_the_structure(chosen: ChosenTests) -> None:
    softer = replace(FRAME, stiffness=0.9 * FRAME.stiffness)
    name = chosen.tests[0].name
    _, findings = compare_with_tests(softer, chosen.tests, chosen, None, OPTIONS, no_progress, {name})
    assert not findings
    clipped = replace(chosen, tests=tuple(replace(test, is_clipped=True) for test in chosen.tests))
    result, _ = compare_with_tests(softer, clipped.tests, clipped, None, OPTIONS, no_progress)
    assert result.amplitude is None
