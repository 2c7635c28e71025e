"""The text of a data logger: header lines with the sampling interval, then number, stamp, channels and events."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.errors import UserError


def read_logger(path: Path, lines: list[str]) -> DataFile:
    """Return the channels of a logger's text.

    The clock counts samples within a part and takes the length of a pause from the stamps, so that it is exact
    inside a part and keeps the order of parts.
    """
    notes = dict(line.split(":", 1) for line in lines[:30] if re.match(r"^[A-Za-z ]+:", line))
    try:
        header = int(notes["Header Size"])
        interval = float(notes["Sampling Interval"])
        words = [word.strip() for word in lines[header - 1].split(",")]
    except (KeyError, ValueError, IndexError):
        raise UserError(path, "line 1", "the logger's header is incomplete", "export the file again") from None
    channels = words[2:-1] if words[-1].lower().startswith("event") else words[2:]
    rows = [line.split(",") for line in lines[header:] if line.strip()]
    try:
        values = np.array([[float(item) for item in row[2 : 2 + len(channels)]] for row in rows])
    except ValueError:
        raise UserError(path, "", "a row holds no numbers where the channels are", "export the file again") from None
    if values.ndim != 2 or values.shape[1] != len(channels) or len(values) < 2:
        raise UserError(path, "", "rows differ in length", "export the file again")
    starts = [index for index, row in enumerate(rows) if len(row) > 2 + len(channels) and _begins(row[-1])]
    starts = sorted({0, *starts})
    ends = [*starts[1:], len(rows)]
    time = np.empty(len(rows))
    origin = _stamp(rows[0][1])
    for start, end in zip(starts, ends, strict=True):
        begin = (_stamp(rows[start][1]) - origin).total_seconds()
        if start:
            begin = max(begin, time[start - 1] + 2.0 * interval)
        time[start:end] = begin + interval * np.arange(end - start)
    return DataFile(
        path=path,
        names=tuple(channels),
        fetch=lambda name: values[:, channels.index(name)],
        table=True,
        time_s=time,
        sampling_rate_hz=1.0 / interval,
        parts=tuple(zip(starts, ends, strict=True)),
        first_row=header + 1,
    )


def _begins(event: str) -> bool:
    return "resume" in event.lower() or "start" in event.lower()


def _stamp(text: str) -> datetime:
    for form in ("%m/%d/%Y %I:%M:%S.%f %p", "%m/%d/%Y %H:%M:%S.%f"):
        try:
            return datetime.strptime(text.strip(), form)
        except ValueError:
            continue
    return datetime(2000, 1, 1)
