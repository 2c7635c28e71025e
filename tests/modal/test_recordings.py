"""Recordings of a frame as arrays: gaps, dead channels and resting shakers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.modal.recordings import frame_test, frame_tests
from mrpipe.modal.records import Place

pytestmark = pytest.mark.property

RATE = 100.0
SOURCE = Path("campaign.yaml")


def recording(kind: str = "sweep", samples: int = 400) -> Recording:
    time = np.arange(samples) / RATE
    channels = {
        "ground_acceleration": np.sin(3.0 * time),
        "floor_acceleration_1": np.sin(3.0 * time + 0.1),
        "floor_acceleration_2": np.sin(3.0 * time + 0.2),
    }
    return Recording("one", "training", RATE, time, channels, ((0, samples),), kind, {})


def with_gap(first: int, lost: int) -> Recording:
    whole = recording()
    keep = np.ones(whole.time_s.size, dtype=bool)
    keep[first : first + lost] = False
    channels = {name: values[keep] for name, values in whole.channels.items()}
    return replace(whole, time_s=whole.time_s[keep], channels=channels, segments=((0, int(keep.sum())),))


def test_the_longest_part_without_a_gap_is_used_and_said() -> None:
    test = frame_test(with_gap(100, 50), SOURCE)
    whole = recording()
    np.testing.assert_array_equal(test.responses[:, 0], whole.channels["floor_acceleration_1"][150:])
    np.testing.assert_array_equal(test.excitation, whole.channels["ground_acceleration"][150:])
    assert "from 1.5 to 3.99 s" in test.note


def test_two_lost_samples_do_not_break_a_record() -> None:
    test = frame_test(with_gap(100, 2), SOURCE)
    assert test.responses.shape[0] == 398 and not test.note


def test_a_gap_within_a_segment_breaks_it() -> None:
    part = replace(with_gap(300, 20), segments=((0, 90), (200, 380)))
    test = frame_test(part, SOURCE)
    # samples 200 to 300 before the gap are the longest part
    np.testing.assert_array_equal(test.responses[:, 0], recording().channels["floor_acceleration_1"][200:300])


@pytest.mark.parametrize("kind", ["sweep", "ambient", "free-decay"])
def test_a_dead_sensor_is_named(kind: str) -> None:
    whole = recording(kind)
    dead = replace(whole, channels={**whole.channels, "floor_acceleration_2": np.full(400, 0.25)})
    with pytest.raises(UserError, match=r"tests\.one\.channels\.floor_acceleration_2: never changes: .* are 0\.25"):
        frame_test(dead, SOURCE)


def test_an_excitation_of_zeros_is_named_where_it_is_needed() -> None:
    whole = recording()
    still = {**whole.channels, "ground_acceleration": np.zeros(400)}
    with pytest.raises(UserError, match=r"ground_acceleration: never changes.* or write kind: ambient"):
        frame_test(replace(whole, channels=still), SOURCE)
    assert frame_test(replace(whole, channels=still, kind="free-decay"), SOURCE).excitation is not None
    assert frame_test(replace(whole, channels=still, kind="ambient"), SOURCE).excitation is None


def test_a_shaker_that_rests_is_no_input() -> None:
    whole = recording()
    channels = {"input_force": np.zeros(400), "input_force_2": np.sin(whole.time_s), **whole.channels}
    channels.pop("ground_acceleration")
    details = {"input_force_floor": 1, "input_force_2_floor": 2}
    test = frame_test(replace(whole, channels=channels, details=details), SOURCE)
    assert list(test.inputs) == [Place(2)]


def test_a_decay_of_a_mode_that_does_not_exist_is_refused() -> None:
    decay = replace(recording("free-decay"), details={"mode": 3})
    with pytest.raises(UserError, match=r"tests\.one\.mode: is 3; a frame of 2 floors has 2 modes"):
        frame_test(decay, SOURCE)
    assert frame_test(replace(decay, details={"mode": 2}), SOURCE).mode == 2


def test_an_excitation_across_all_sensors_is_told() -> None:
    whole = recording()
    turned = {f"{name}_{'y' if name.startswith('ground') else 'x'}": item for name, item in whole.channels.items()}
    assert "acts along y and its sensors along x" in frame_test(replace(whole, channels=turned), SOURCE).note
    along = {f"{name}_x": item for name, item in whole.channels.items()}
    assert not frame_test(replace(whole, channels=along), SOURCE).note


def test_parts_of_a_record_with_a_gap_are_all_used() -> None:
    campaign = Campaign("c", "shear-frame", Path(), (with_gap(180, 30),), floor_masses_kg=(1.0, 1.0))
    tests = frame_tests(campaign)
    assert [(test.name, test.responses.shape[0]) for test in tests.forced] == [("one-1", 180), ("one-2", 190)]
    assert tests.notes == ["test one: its clock has gaps; 2 parts without a gap, 3.7 of 3.7 s, are used"]


def test_both_listed_segments_are_used() -> None:
    part = replace(recording(), segments=((0, 150), (200, 380)))
    tests = frame_tests(Campaign("c", "shear-frame", Path(), (part,), floor_masses_kg=(1.0, 1.0)))
    assert [test.responses.shape[0] for test in tests.forced] == [150, 180] and not tests.notes


def test_free_decays_alone_are_sufficient_and_a_campaign_without_any_test_of_modes_is_refused() -> None:
    campaign = Campaign("c", "shear-frame", Path(), (recording("free-decay"),), floor_masses_kg=(1.0, 1.0))
    tests = frame_tests(campaign)
    assert [test.name for test in tests.decays] == ["one"] and not tests.forced and not tests.ambient
    with pytest.raises(UserError, match="modes need a test of kind sweep, random, ambient or free-decay"):
        frame_tests(replace(campaign, recordings=(recording("harmonic"),)))
