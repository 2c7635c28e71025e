"""Segments and parts of a record: what is kept, and what is reported."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.campaigns.clock import Clock
from mrpipe.campaigns.schema import TestEntry
from mrpipe.campaigns.segments import segments_beyond

pytestmark = pytest.mark.property

CLOCK = Clock(np.arange(4000) / 1000.0, 1000.0)


@pytest.mark.parametrize(
    ("segments", "lines"),
    [
        (None, 0),
        ([[1.0, 3.0]], 0),
        ([[1.0, 5.0]], 0),
        ([[1.0, 50.0]], 1),
        ([[-9.0, 1.0]], 1),
        ([[0.0, 1.0], [3.0, 30.0]], 1),
    ],
)
def test_a_segment_much_longer_than_the_record_is_reported(segments: list | None, lines: int) -> None:
    entry = TestEntry(name="one", file="one.csv", segments_s=segments)
    found = segments_beyond(entry, CLOCK)
    assert len(found) == lines
    assert all(line.startswith("test one: segments_s is [") for line in found)


def test_the_report_holds_what_was_used() -> None:
    entry = TestEntry(name="one", file="one.csv", segments_s=[[1.0, 50.0]])
    assert segments_beyond(entry, CLOCK) == [
        "test one: segments_s is [1, 50] s, but the record holds only 1 to 3.999 s of it"
    ]
