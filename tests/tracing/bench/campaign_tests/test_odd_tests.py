"""Harmed training tests are left out; harmed validation tests stay, and the verdict names them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.campaign_tests.odd_tests import SAME_RECORD, sort_tests
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted


def scaled(test: PreparedTest, factor: float) -> PreparedTest:
    return replace(test, force_n=factor * test.force_n, force_raw_n=factor * test.force_raw_n)


def changed(place: int, factor: float) -> list[PreparedTest]:
    tests = campaign("")
    tests[place] = scaled(tests[place], factor)
    return tests


@pytest.mark.parametrize("factor", [1e-3, -1.0])
def test_a_training_test_in_another_unit_or_sign_is_left_out(factor: float) -> None:
    tests = changed(1, factor)
    found = sort_tests(tests)
    assert found.left_out == (tests[1].name,)
    assert tests[1].name in found.sentence
    assert len(found.tests) == len(tests) - 1


def test_a_harmed_validation_test_stays_and_is_known() -> None:
    tests = changed(-1, 1e-3)
    found = sort_tests(tests)
    assert found.left_out == ()
    assert set(found.faults) == {tests[-1].name}


def test_a_validation_test_that_repeats_a_record_is_left_out() -> None:
    tests = campaign("")
    copy = replace(tests[0], name="copy", role="validation")
    found = sort_tests([*tests, copy])
    assert found.left_out == ("copy",)
    assert found.findings[0].name == SAME_RECORD


def test_sound_tests_are_all_used() -> None:
    tests = campaign("")
    found = sort_tests(tests)
    assert (found.left_out, found.sentence, found.faults) == ((), "", {})


@pytest.mark.parametrize("channel", ["force", "displacement"])
def test_a_channel_that_is_dead_in_every_test_is_a_mistake_of_the_user(channel: str) -> None:
    """Every test was kept because none was left without the dead ones; the fit ended with a traceback."""
    name = {"force": "force_raw_n", "displacement": "displacement_raw_m"}[channel]
    tests = [replace(test, **{name: np.zeros_like(test.force_raw_n)}) for test in campaign("")]
    with pytest.raises(UserError, match=f"channels.{channel}.*same value in all samples of each of the"):
        sort_tests(tests)
    # one sound test is enough for a verdict
    assert sort_tests([*tests[1:], campaign("")[0]]).tests
