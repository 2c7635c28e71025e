"""Delimited text: csv and its relatives, and the text of a data logger with its pauses."""

from __future__ import annotations

import io
import re
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError

_NUMBER = re.compile(r"^[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?$|^[+-]?(nan|inf(inity)?)$", re.IGNORECASE)


def read_table(path: Path, layout: TextEntry | None = None) -> DataFile:
    """Read delimited text; header lines, delimiter and decimal sign are found where `layout` does not give them.

    A header is any line above the first row of numbers that has as many fields as it; where several have, each
    of their words names its column. Without one, columns are called by position from 0. An empty column after a
    trailing delimiter is dropped.

    Raises
    ------
    UserError
        If the file holds no row of numbers.
    """
    layout = layout or TextEntry()
    text = _decode(path)
    lines = text.splitlines()
    if lines and lines[0].lower().startswith("header size"):
        return _read_logger(path, lines)
    comment = layout.comment or "%#"
    first, delimiter, decimal = _first_row(path, lines, layout, comment)
    fields = _split(lines[first], delimiter)
    width = len(fields)
    headers = [
        [word.strip().strip("\"'") for word in _split(line.lstrip(comment).strip(), delimiter)]
        for line in lines[layout.skip_lines : first]
        if line.strip()
    ]
    headers = [row for row in headers if len(row) == width or (len(row) == width - 1 and fields[-1] == "")]
    frame = pd.read_csv(
        io.StringIO("\n".join(line for line in lines[first:] if line.strip() and line[0] not in comment)),
        sep=delimiter or r"\s+",
        decimal=decimal,
        header=None,
        names=list(range(width)),
        index_col=False,
        skipinitialspace=True,
        dtype=None,
        low_memory=False,
        na_values=[],
    )
    keep = [index for index in range(width) if not (index == width - 1 and frame[index].isna().all())]
    names = _names(headers, keep)
    aliases = {word: names[index] for row in headers for index, word in enumerate(row) if word and index < len(names)}
    positions = dict(zip(names, keep, strict=True))
    return DataFile(
        path=path,
        names=tuple(names),
        fetch=lambda name: _numbers(path, frame[positions[name]], name, first),
        table=True,
        first_row=first + 1,
        aliases={word: name for word, name in aliases.items() if word not in names},
    )


def _decode(path: Path) -> str:
    raw = path.read_bytes()
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _split(line: str, delimiter: str | None) -> list[str]:
    return line.split() if delimiter is None else [item.strip() for item in line.split(delimiter)]


def _is_numeric(fields: list[str]) -> bool:
    """Whether every field is a number or empty, with a number among them."""
    filled = [item for item in fields if item]
    return bool(filled) and all(_NUMBER.match(item) for item in filled)


def _first_row(path: Path, lines: list[str], layout: TextEntry, comment: str) -> tuple[int, str | None, str]:
    """Return the index of the first row of numbers, the delimiter (None: white space) and the decimal sign."""
    candidates: list[str | None] = [layout.delimiter] if layout.delimiter else ["\t", ";", ",", None]
    for index in range(layout.skip_lines, min(len(lines), layout.skip_lines + 200)):
        line = lines[index].strip("\r\n")
        if not line.strip() or line[0] in comment:
            continue
        for delimiter in candidates:
            fields = _split(line.strip() if delimiter is None else line, delimiter)
            if delimiter is not None and delimiter not in line:
                continue
            if _is_numeric(fields) and (delimiter is None or len(fields) > 1):
                comma = delimiter != "," and any("," in item for item in fields)
                return index, delimiter, layout.decimal or ("," if comma else ".")
    raise UserError(path, "", "holds no row of numbers", "name a delimited text, or give text: {skip_lines, delimiter}")


def _names(headers: list[list[str]], keep: list[int]) -> list[str]:
    """Return one name a column: the first header line that has one, else the position."""
    names: list[str] = []
    for index in keep:
        words = [row[index] for row in headers if index < len(row) and row[index]]
        name = words[0] if words else str(index)
        names.append(name if name not in names else f"{name}#{index}")
    return names


def _numbers(path: Path, column: Any, name: str, first: int) -> FloatArray:
    """Return a column as floats; text within it is told with its line."""
    if column.dtype.kind in "fiub":
        return np.asarray(column, dtype=np.float64)
    numbers = pd.to_numeric(column, errors="coerce")
    wrong = numbers.isna() & column.notna()
    if wrong.any():
        row = int(np.argmax(wrong.to_numpy()))
        raise UserError(
            path, f"line {first + 1 + row}, column {name}", f"{column.iloc[row]!r} is no number", "write a number"
        )
    return np.asarray(numbers, dtype=np.float64)


def _read_logger(path: Path, lines: list[str]) -> DataFile:
    """Read a DAQ logger's text: header lines with the interval, then number, stamp, channels, events.

    The clock counts samples within a part and takes the length of a pause from the stamps, so that it is exact
    inside a part and keeps the order of parts.
    """
    notes = dict(line.split(":", 1) for line in lines[:30] if re.match(r"^[A-Za-z ]+:", line))
    try:
        header = int(notes["Header Size"])
        interval = float(notes["Sampling Interval"])
        words = [word.strip() for word in lines[header - 1].split(",")]
    except (KeyError, ValueError, IndexError):
        raise UserError(path, "line 1", "the logger's header is not whole", "export the file again") from None
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
