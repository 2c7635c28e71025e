"""Loggers whose clocks are far apart in a forced test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.ambient.clocks import reach_s
from mrpipe.modal.clocks.delays import SensorClock, corrected
from mrpipe.modal.loggers import aligned, far_clocks, limit_findings
from mrpipe.modal.records import FrameTest
from tests.modal.rig import Rig, random_frame, sweep_test

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3)


@pytest.fixture(scope="module")
def on_time() -> FrameTest:
    return sweep_test(FRAME, np.random.default_rng(1), Rig(noise=0.01, rate=100.0, sweep_s=160.0), shaker_floor=3)


def _late(test: FrameTest, floors: tuple[int, ...], delay_s: float) -> FrameTest:
    """Return the test with a delay of the sensors of some floors."""
    clocks = [SensorClock(test.name, sensor, delay_s, 0.0) for sensor in test.sensors if sensor.floor in floors]
    return aligned_ends(replace(test, responses=corrected(test, clocks).responses))


def aligned_ends(test: FrameTest) -> FrameTest:
    """Return the test without its first and last second, in which delayed samples do not exist."""
    cut = round(test.sampling_rate_hz)
    assert test.excitation is not None
    return replace(test, excitation=test.excitation[cut:-cut], responses=test.responses[cut:-cut])


def test_clocks_that_agree_have_no_delay(on_time: FrameTest) -> None:
    assert far_clocks([on_time], 0.2, 0.0) == ()
    assert aligned(on_time, ()) is on_time


@pytest.mark.parametrize("floors", [(1,), (1, 2), (1, 2, 3)])
def test_a_late_logger_is_found_relative_to_the_excitation(on_time: FrameTest, floors: tuple[int, ...]) -> None:
    test = _late(on_time, floors, 0.4)
    found = far_clocks([test], 0.2, 0.0)
    assert {item.sensor.floor for item in found} == set(floors)
    assert [item.offset_s for item in found] == pytest.approx([-0.4] * len(floors), abs=0.02)
    moved = aligned(test, found)
    assert moved.responses.shape[0] == pytest.approx(test.responses.shape[0] - 40, abs=3)
    assert moved.excitation is not None and moved.excitation.size == moved.responses.shape[0]


def test_a_delay_at_the_limit_of_the_search_is_stated(on_time: FrameTest) -> None:
    sensor, limit = on_time.sensors[0], reach_s(on_time)
    [line] = limit_findings([on_time], [SensorClock(on_time.name, sensor, 0.95 * limit, 0.0)])
    assert "at the limit of the search" in line
    assert not limit_findings([on_time], [SensorClock(on_time.name, sensor, 0.5 * limit, 0.0)])
