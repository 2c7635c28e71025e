"""Time stamps of text files as seconds: dates of several countries, times of day, and minutes with seconds."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError

_DATE = r"(?:\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}[./]\d{1,2}[./]\d{2,4})"
_TIME = r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?:\s?[AaPp][Mm])?(?:Z|[+-]\d{2}:?\d{2})?"
_MINUTES = r"\d{1,2}:\d{2}[.,]\d+"
_STAMP = re.compile(rf"^(?:{_DATE}(?:[T ]{_TIME})?|{_TIME}|{_MINUTES})$")
_DAY_S, _HOUR_S = 86400.0, 3600.0


def is_stamp(text: str) -> bool:
    """Return whether a text is a time stamp: a date, a date with a time, a time of day, or minutes with seconds."""
    return _STAMP.match(text) is not None


def seconds_of(path: Path, column: Any, name: str, lines: tuple[int, ...]) -> FloatArray:
    """Return time stamps as seconds from the first one, shape (n,).

    Times of day may pass midnight. Spreadsheets show times as minutes and seconds (`59:59.9`), which may pass an hour.

    Parameters
    ----------
    path
        File, for messages.
    column
        Column of text of a pandas frame.
    name
        Name of the column, for messages.
    lines
        Line of each sample.

    Raises
    ------
    UserError
        If a stamp cannot be read; it names the line.
    """
    text = column.astype(str).str.strip().str.replace(",", ".", regex=False)
    minutes = re.fullmatch(_MINUTES, text.iloc[0]) is not None
    stamps = _parsed("0:" + text if minutes else text)
    wrong = stamps.isna()
    if wrong.any():
        row = int(np.argmax(wrong.to_numpy()))
        where = f"line {lines[row]}, column {name}"
        raise UserError(path, where, f"{column.iloc[row]!r} is not a time stamp", "write it as 2026-03-01T12:00:00.000")
    seconds = np.array((stamps - stamps.iloc[0]).dt.total_seconds(), dtype=np.float64)
    period = _HOUR_S if minutes else _DAY_S
    if minutes or re.fullmatch(_TIME, text.iloc[0]):
        seconds[1:] += period * np.cumsum(np.diff(seconds) < -0.5 * period)
    return seconds


def _parsed(text: Any) -> Any:
    """Return a column of stamps; of `12/03/2026` as day or month first, the reading with the shorter record counts."""

    def read(day_first: bool) -> Any:
        return pd.to_datetime(text, errors="coerce", dayfirst=day_first, format="mixed", utc=True)

    if not re.match(r"^\d{1,2}/", text.iloc[0]):
        return read(re.match(r"^\d{1,2}\.", text.iloc[0]) is not None)
    month_first, day_first = read(False), read(True)
    return min((month_first, day_first), key=lambda item: (item.isna().sum(), item.max() - item.min()))
