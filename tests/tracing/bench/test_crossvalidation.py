"""Tests are left out so that what is left still holds every drive level."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrpipe.tracing.bench.crossvalidation import folds_of, seen_by


@pytest.mark.property
@pytest.mark.parametrize("folds", [2, 3])
def test_no_fold_takes_a_drive_level_away(folds: int) -> None:
    """A campaign of three frequencies at 0, 1, 2 A in turn: every third test is one level."""
    levels = np.tile([0.0, 1.0, 2.0], 3)
    recordings = cast(
        Any,
        SimpleNamespace(
            tests=9,
            test=np.repeat(np.arange(9), 50),
            drive=np.repeat(levels, 50),
            displacement=np.tile(np.sin(np.linspace(0, 6, 50)), 9),
        ),
    )
    parts = folds_of(recordings, folds)
    assert sorted(index for part in parts for index in part) == list(range(9))
    for part in parts:
        assert {levels[index] for index in range(9) if index not in part} == {0.0, 1.0, 2.0}


@pytest.mark.property
def test_what_a_fold_has_not_seen_is_not_held_against_an_effect() -> None:
    def recordings(stroke: float, drive: float) -> Any:
        wave = np.sin(np.linspace(0.0, 6.28, 400))
        return SimpleNamespace(force=wave, displacement=stroke * wave, velocity=0.1 * wave, drive=np.full(400, drive))

    inside = seen_by(recordings(8e-3, 1.0), recordings(1e-2, 1.0))
    assert np.array_equal(inside, np.abs(recordings(1e-2, 1.0).displacement) <= 8e-3 * 1.02)
    assert seen_by(recordings(1e-2, 1.0), recordings(8e-3, 1.0)).all()
    assert not seen_by(recordings(1e-2, 1.0), recordings(8e-3, 2.0)).any()
