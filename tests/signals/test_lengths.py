"""Tests that are too short for the filters are found before `prepare` refuses them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from mrpipe.errors import UserError
from mrpipe.signals.lengths import find_short_tests
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import length_needed, prepare_campaign
from tests.signals.test_preparation import campaign, recording

pytestmark = pytest.mark.property

OPTIONS = PreparationOptions()


def test_the_shortest_test_that_is_not_named_is_the_shortest_that_is_prepared() -> None:
    needed = length_needed(OPTIONS, 1000.0)
    short = recording("short", seconds=(needed - 1) / 1000.0)
    long = recording("long", seconds=needed / 1000.0)
    (found,) = find_short_tests(campaign(short, long), OPTIONS)
    assert (found.name, found.severity, found.test) == ("too-short", "error", "short")
    assert found.numbers == {"samples": needed - 1.0, "samples_needed": float(needed)}
    with pytest.raises(UserError, match=f"short.* has {needed - 1} samples .* its filters need {needed}"):
        prepare_campaign(campaign(recording("whole"), short), OPTIONS)


def test_samples_count_at_the_working_rate() -> None:
    needed = length_needed(OPTIONS, 500.0)
    test = recording("a", rate=5000.0, seconds=(needed - 5) / 500.0)
    (found,) = find_short_tests(campaign(test), PreparationOptions(working_rate_hz=500.0))
    assert found.numbers == {"samples": needed - 5.0, "samples_needed": float(needed)}


def test_every_segment_is_judged() -> None:
    test = recording("a", seconds=10.0)
    parts = replace(test, segments=((0, 5000), (5000, 5010)))
    (found,) = find_short_tests(campaign(parts), OPTIONS)
    assert found.numbers["samples"] == 10.0


def test_the_message_names_the_file_of_the_test() -> None:
    test = replace(recording("b", seconds=0.04), file=Path("data/b.csv"))
    with pytest.raises(UserError, match=r"^data/b\.csv: test b: has 40 samples"):
        prepare_campaign(campaign(recording("a"), test), OPTIONS)
