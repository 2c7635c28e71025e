"""Recordings that are divided at gaps of their clock and at their segments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import Campaign, Recording
from mrpipe.campaigns.parts import in_unbroken_parts

pytestmark = pytest.mark.property

RATE = 100.0


def campaign(*lost: tuple[int, int], kind: str = "ambient", samples: int = 3000) -> Campaign:
    """Return a campaign of one recording whose clock lacks some ranges of samples."""
    keep = np.ones(samples, dtype=bool)
    for begin, end in lost:
        keep[begin:end] = False
    time = np.arange(samples)[keep] / RATE
    test = Recording("long", "training", RATE, time, {"floor_acceleration_1": time}, ((0, time.size),), kind)
    return Campaign("c", "shear-frame", Path(), (test,))


def lengths(found: Campaign) -> list[int]:
    return [end - begin for item in found.recordings for begin, end in item.segments]


def test_a_recording_without_a_gap_keeps_its_name() -> None:
    found = in_unbroken_parts(campaign(), {"ambient"})
    assert [item.name for item in found.campaign.recordings] == ["long"] and not found.notes


def test_parts_of_similar_length_are_kept_and_short_ones_are_left_out() -> None:
    found = in_unbroken_parts(campaign((1000, 1050), (1200, 1250), (2200, 2210)), {"ambient"})
    assert [item.name for item in found.campaign.recordings] == ["long-1", "long-2", "long-3"]
    assert lengths(found.campaign) == [1000, 950, 790]
    assert found.notes == (
        "test long: its clock has gaps; 3 parts without a gap, 27.4 of 28.9 s, are used, 1 shorter one is left out",
    )


def test_one_part_is_left_of_a_recording_with_a_gap_near_its_end() -> None:
    found = in_unbroken_parts(campaign((2800, 2850)), {"ambient"})
    assert [item.name for item in found.campaign.recordings] == ["long"]
    assert "1 part without a gap, 28 of 29.5 s, is used" in found.notes[0]


def test_a_free_decay_is_not_divided() -> None:
    whole = campaign((1000, 1050), kind="free-decay")
    assert in_unbroken_parts(whole, {"ambient"}).campaign.recordings == whole.recordings
