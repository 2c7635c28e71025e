"""A mistake in the whole campaign is named, and not as many mistakes of the tests that are right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from mrpipe.campaigns import Campaign, Recording
from mrpipe.campaigns.plausibility import Finding, judge
from mrpipe.campaigns.plausibility.consequences import without_consequences
from tests.campaigns.plausibility.rig import sound_tests

WRONG = 7
"""Of ten tests, the last three are right."""


def _campaign(factor: float, wrong: int = WRONG) -> Campaign:
    recordings = []
    for index, test in enumerate(sound_tests(10)):
        size = factor if index < wrong else 1.0
        channels = {"displacement": size * test.displacement_m, "drive": test.drive, "force": test.force_n}
        recordings.append(Recording(test.name, test.role, 1000.0, test.time_s, channels, segments=((0, 4000),)))
    return Campaign("own", "damper-bench", Path("own"), tuple(recordings), drive_unit="A")


@pytest.mark.planted
def test_tests_in_which_the_unit_is_right_are_not_to_be_corrected() -> None:
    (found,) = [item for item in judge(_campaign(1e3)) if item.channel == "displacement"]
    assert found.name == "unit-range" and "in 7 of 10 tests" in found.sentence


@pytest.mark.planted
def test_a_wrong_unit_of_few_tests_is_named_with_these_tests() -> None:
    found = [item for item in judge(_campaign(1e3, wrong=2)) if item.name == "unit-decades"]
    assert [item.test for item in found] == ["T0", "T1"]


@pytest.mark.property
def test_only_what_follows_from_a_finding_on_the_campaign_is_left_out() -> None:
    whole = Finding("channels-exchanged", "error", "exchanged", "exchange")
    single = replace(whole, test="T1", channel="displacement")
    other = replace(single, name="sign-reversed")
    assert without_consequences([single, whole, other]) == [whole, other]
    assert without_consequences([single, other]) == [single, other]
    large = Finding(
        "unit-range", "error", "large", "unit", channel="force", numbers={"amplitude_si": 9e9, "largest_si": 1e7}
    )
    small = replace(single, name="unit-decades", channel="force", numbers={"factor_to_correct": 1e3})
    too = replace(small, numbers={"factor_to_correct": 1e-3})
    elsewhere = replace(small, channel="displacement")
    assert without_consequences([large, small, too, elsewhere]) == [large, too, elsewhere]
