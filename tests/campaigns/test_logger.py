"""The text of a data logger: its clock over pauses, its channels, and faults that are reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.logger import read_logger
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

HEAD = ["Logger: X1", "Header Size: 4", "Sampling Interval: 0.01", "Number,Stamp,force,stroke,Events"]


def _row(number: int, stamp: str, force: float, event: str = "") -> str:
    return f"{number},{stamp},{force},{-force},{event}"


def _text(*rows: str) -> list[str]:
    return [*HEAD, *rows]


def _seconds(value: float) -> str:
    return f"11/22/2026 10:00:{value:09.6f} AM"


def test_the_clock_counts_samples_within_a_part_and_takes_pauses_from_the_stamps() -> None:
    # the stamps jitter by milliseconds; the second part begins 5 s after the first
    stamps = [0.0, 0.013, 0.018, 5.0, 5.012]
    rows = [_row(k, _seconds(stamp), 1.0 + k, "Resume" if k == 3 else "") for k, stamp in enumerate(stamps)]
    found = read_logger(Path("a.txt"), _text(*rows))
    assert found.names == ("force", "stroke")
    assert found.parts == ((0, 3), (3, 5))
    assert found.time_s == pytest.approx(np.array([0.0, 0.01, 0.02, 5.0, 5.01]))
    assert found.sampling_rate_hz == pytest.approx(100.0)
    assert found.fetch("stroke") == pytest.approx([-1.0, -2.0, -3.0, -4.0, -5.0])


def test_parts_keep_their_order_if_the_clock_was_set_back() -> None:
    rows = [_row(0, _seconds(30.0), 1.0), _row(1, _seconds(30.01), 1.0), _row(2, _seconds(2.0), 1.0, "start")]
    time = read_logger(Path("a.txt"), _text(*rows)).time_s
    assert time is not None
    assert np.all(np.diff(time) > 0.0)


def test_a_stamp_of_24_hours_is_read() -> None:
    rows = [_row(0, "11/22/2026 23:59:59.5", 1.0), _row(1, "11/23/2026 00:00:01.5", 2.0, "resume")]
    assert read_logger(Path("a.txt"), _text(*rows)).time_s == pytest.approx([0.0, 2.0])


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        (HEAD[:1] + HEAD[2:], "header is incomplete"),
        ([HEAD[0], "Header Size: 40", *HEAD[2:]], "header is incomplete"),
        (_text(_row(0, _seconds(0.0), 1.0), "1,x,abc,2,"), "holds no numbers"),
        (_text(_row(0, _seconds(0.0), 1.0), "1,x"), "no numbers|differ in length"),
        (_text(_row(0, _seconds(0.0), 1.0)), "differ in length"),
    ],
)
def test_faults_are_reported_in_one_line(lines: list[str], problem: str) -> None:
    with pytest.raises(UserError, match=problem):
        read_logger(Path("a.txt"), lines)
