"""The clock of a test: its rate, gaps, jitter and rounding."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.campaigns.clock import build_clock
from mrpipe.campaigns.columns import DataFile
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

TIME = np.arange(500) / 250.0


def data_file(**changes: Any) -> DataFile:
    return DataFile(Path("one.csv"), ("t",), lambda name: TIME, **changes)


def test_a_rate_alone_makes_an_even_clock() -> None:
    clock = build_clock(data_file(), None, 250.0, 500, "test one")
    assert clock.sampling_rate_hz == 250.0 and clock.findings == ()
    np.testing.assert_allclose(clock.time_s, TIME, atol=1e-12)


def test_the_rate_is_measured_from_the_time_channel() -> None:
    assert build_clock(data_file(), TIME, None, 500, "test one").sampling_rate_hz == pytest.approx(250.0)


def test_a_clock_with_few_digits_is_made_even() -> None:
    clock = build_clock(data_file(), np.round(np.arange(500) / 300.0, 3), None, 500, "test one")
    assert np.ptp(np.diff(clock.time_s)) < 1e-9


def test_lost_samples_are_counted() -> None:
    kept = np.delete(TIME, [100, 101, 102])
    (finding,) = build_clock(data_file(), kept, None, kept.size, "test one").findings
    assert "1 gap in the clock, 3 samples are missing" in finding and "at 0.396 s" in finding


def test_jitter_is_reported_and_is_no_gap() -> None:
    jitter = TIME + np.random.default_rng(1).uniform(-0.3, 0.3, TIME.size) / 250.0
    (finding,) = build_clock(data_file(), jitter, None, 500, "test one").findings
    assert "clock jitter" in finding


@pytest.mark.parametrize(
    ("time", "rate", "samples", "message"),
    [
        (None, None, 500, "no clock"),
        (TIME, None, 499, "time has 500 samples, the channels 499"),
        (TIME, 300.0, 500, "the clock runs at 250 Hz, but sampling_rate_hz says 300"),
        (np.where(np.arange(500) == 7, np.nan, TIME), None, 500, "time is nan"),
        (np.where(np.arange(500) == 7, 0.0, TIME), None, 500, "a clock that increases"),
    ],
)
def test_an_impossible_clock_is_refused(time: Any, rate: float | None, samples: int, message: str) -> None:
    with pytest.raises(UserError, match=message):
        build_clock(data_file(), time, rate, samples, "test one")


def test_a_clock_with_too_few_digits_names_the_way_out() -> None:
    time = np.floor(np.arange(500) / 2.0) / 1000.0
    with pytest.raises(
        UserError, match=r"250 of 500 samples have the same time .*; export the time with more digits, or"
    ):
        build_clock(data_file(), time, None, 500, "test one")
