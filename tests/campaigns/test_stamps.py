"""Time stamps as seconds: what spreadsheets and loggers of several countries write."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from mrpipe.campaigns.stamps import is_stamp, seconds_of
from mrpipe.errors import UserError

pytestmark = pytest.mark.golden


@pytest.mark.parametrize(
    "stamps",
    [
        ["59:59.5", "00:00.0", "00:01.5"],  # minutes and seconds past an hour, as spreadsheets show times
        ["23:59:59,5", "00:00:00,0", "00:00:01,5"],
        ["12/03/2026 23:59:59.5", "13/03/2026 00:00:00.0", "13/03/2026 00:00:01.5"],  # day first
        ["03/12/2026 23:59:59.5", "03/13/2026 00:00:00.0", "03/13/2026 00:00:01.5"],  # month first
        ["03/04/2026 23:59:59.5", "04/04/2026 00:00:00.0", "04/04/2026 00:00:01.5"],  # either, but not a month long
        ["04/03/2026 23:59:59.5", "04/04/2026 00:00:00.0", "04/04/2026 00:00:01.5"],
    ],
)
def test_a_second_and_a_half_across_the_turn_of_a_period(stamps: list[str]) -> None:
    assert all(is_stamp(item) for item in stamps)
    assert seconds_of(Path("a.csv"), pd.Series(stamps), "t", (2, 3, 4)).tolist() == [0.0, 0.5, 2.0]


def test_a_stamp_that_cannot_be_is_named_with_its_line() -> None:
    stamps = pd.Series(["2026-03-01 12:00:00", "2026-33-01 12:00:01", "2026-03-01 12:00:02"])
    with pytest.raises(UserError, match="line 3, column t: '2026-33-01 12:00:01' is not a time stamp; write it as"):
        seconds_of(Path("a.csv"), stamps, "t", (2, 3, 4))


@pytest.mark.parametrize("text", ["1.5", "12", "a:b", "1:2:3:4", "2026"])
def test_numbers_and_words_are_no_stamps(text: str) -> None:
    assert not is_stamp(text)
