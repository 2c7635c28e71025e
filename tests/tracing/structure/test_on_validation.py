"""A validation test that differs from the training tests is said to differ, with the faulty sensor."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrpipe.campaigns.model import Campaign
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.on_validation import DifferingTest, in_words
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.trace import trace_frame
from tests.tracing.structure.rig import frame_campaign
from tests.tracing.structure.test_sensor_faults import faulty_campaign

pytestmark = pytest.mark.planted


def _summary(campaign: Campaign) -> dict[str, Any]:
    library = list(all_structural_effects().values())
    rng = np.random.default_rng(1)
    return trace_frame(frame_data(campaign), library, [], NamingRules(), most=1, draws=40, rng=rng).summary


def _with_validation(campaign: Campaign, channel: str, factor: float) -> Campaign:
    return replace(
        campaign,
        recordings=tuple(
            replace(item, channels={**item.channels, channel: factor * item.channels[channel]})
            if item.role == "validation"
            else item
            for item in campaign.recordings
        ),
    )


@pytest.mark.parametrize("factor", [-1.0, 1.3])
def test_a_faulty_sensor_in_the_validation_test_alone(factor: float) -> None:
    found = _summary(_with_validation(frame_campaign("clean"), "floor_acceleration_2", factor))
    assert found["verdict_class"] == "validation differs"
    (test,) = found["frame"]["differing_tests"]
    assert test["name"] == "random-2" and test["error_over_noise_floor"] > 2.0
    assert test["sensor_fault"]["channel"] == "floor_acceleration_2"
    assert test["sensor_fault"]["gain"] == pytest.approx(factor, rel=0.03)


def test_a_validation_test_like_the_training_tests_does_not_differ() -> None:
    found = _summary(frame_campaign("clean"))
    assert found["verdict_class"] == "noise"
    assert found["frame"]["differing_tests"] == []


def test_a_faulty_sensor_in_all_tests_is_in_the_verdict_and_no_effect_is_named() -> None:
    found = _summary(faulty_campaign("gain"))
    assert found["verdict_class"] == "unknown" and found["effects"] == []
    assert found["frame"]["sensor_fault"]["channel"] == "floor_acceleration_3"
    assert found["frame"]["sensor_fault"]["gain"] == pytest.approx(0.85, abs=0.01)
    assert "floor_acceleration_3 has a gain of 0.85" in found["verdict"]


@pytest.mark.property
def test_the_sentence_says_what_differs() -> None:
    larger = DifferingTest("quake", 5.0, 3.0, None)
    other = DifferingTest("random", 4.0, 0.5, None)
    text = in_words([larger, other])
    assert "validation test quake is 5 times the noise, and its drift is 3 times that of the training tests" in text
    assert "validation test random is 4 times the noise, and no fault of a single sensor explains it" in text
