"""Two floors of a tower whose accelerometers were exchanged in all tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.exchange import exchanged_floors, grows
from mrpipe.tracing.structure.records import FrameRecord
from tests.tracing.structure.towers import MASSES, tower_records

pytestmark = pytest.mark.planted


def _problem(kind: str, pair: tuple[int, int] | None) -> FrameProblem:
    records = [_exchanged(item, pair) for item in tower_records(kind)]
    return frame_problem(records[:2], records[2:], MASSES)


def _exchanged(record: FrameRecord, pair: tuple[int, int] | None) -> FrameRecord:
    if pair is None:
        return record
    acceleration = record.acceleration.copy()
    first, second = pair[0] - 1, pair[1] - 1
    acceleration[:, [first, second]] = acceleration[:, [second, first]]
    return replace(record, acceleration=acceleration)


@pytest.mark.parametrize(("kind", "pair"), [("shear", (2, 5)), ("wall", (3, 4)), ("wall and frame", (5, 6))])
def test_exchanged_floors_of_a_tower_are_found(kind: str, pair: tuple[int, int]) -> None:
    found = exchanged_floors(_problem(kind, pair))
    assert found is not None and (found.floor, found.exchanged_with, found.test) == (*pair, "")
    assert "are exchanged in all tests" in found.sentence()


@pytest.mark.parametrize("kind", ["shear", "wall"])
def test_the_floors_of_a_sound_tower_are_not_exchanged(kind: str) -> None:
    assert exchanged_floors(_problem(kind, None)) is None


def test_a_shape_grows_within_the_errors_of_gains() -> None:
    assert grows(np.array([0.2, 0.6, 1.0, 0.99]), 0.02)
    assert not grows(np.array([0.2, 1.0, 0.6]), 0.02)
    assert not grows(np.array([-0.2, 0.6, 1.0]), 0.02)
