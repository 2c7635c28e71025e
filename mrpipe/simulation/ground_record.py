"""Recorded histories that act on a structure: downloaded records, or text with time and columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.readers.row import fields_of
from mrpipe.campaigns.readers.strong_motion import (
    ENDINGS,
    common_window,
    read_strong_motion,
    refuse_other_records,
)
from mrpipe.errors import UserError
from mrpipe.units import bracketed_units, conversion, same_dimension, to_si

HORIZONTAL = 2
"""Largest number of horizontal channels of a record that are used if none is named."""

UNIFORM_SHARE = 0.9
"""A clock is that of a recorder, and not of straight lines, where so many of its steps are equal."""

LONGEST_GAP = 10.0
"""Longest step of the clock of a recorder over its usual one; a longer one is a gap in the record."""


def read_histories(
    path: Path,
    unit: str,
    *,
    channels: Sequence[str | int] = (),
    quantity: str = "acceleration",
    file_setting: str = "simulate.excitation.file",
    unit_setting: str = "simulate.excitation.file_unit",
    channels_setting: str = "simulate.excitation.file_channels",
) -> tuple[FloatArray, FloatArray]:
    """Return time [s], shape (m,), and histories in SI, shape (m, k).

    Parameters
    ----------
    path
        PEER AT2, COSMOS or CSMIP V2, or a zip of them; else text or CSV: time [s] and one or more columns, numbers
        divided by blanks, commas or semicolons; lines before and after them that do not begin with a number are
        headers, and lines that begin with # or % are comments.
    unit
        Unit of the columns of a text file.
    channels
        Names or numbers (from 1) of the histories; empty: all columns of a text file, and the horizontal channels of
        a record with at most two.
    quantity
        `acceleration` or `force`.
    file_setting, unit_setting, channels_setting
        Settings that name file, unit and channels, for messages.

    Raises
    ------
    UserError
        If the file is missing, a row has other numbers of columns, the clock does not rise, or a channel is not there.
    """
    if not path.name:
        raise UserError(file_setting, "", "is empty", "name a text file of time [s] and acceleration, or a record")
    if not path.is_file():
        raise UserError(file_setting, str(path), "there is no such file", "name a text file or a record")
    refuse_other_records(path)
    if path.suffix.lower() in ENDINGS:
        if quantity != "acceleration":
            raise UserError(path, "", "holds accelerations", f"give a text file of time [s] and {quantity}")
        return _from_record(path, channels, channels_setting)
    table, headers = _table(path)
    _require_unit(path, headers, unit, quantity, unit_setting)
    names = _column_names(headers, table.shape[1])
    columns = [_place(path, item, names) + 1 for item in channels] or list(range(1, table.shape[1]))
    if not np.any(table[:, columns]):
        raise UserError(path, "", "holds nothing but zeros", "give a record that moves")
    return table[:, 0], to_si(table[:, columns], unit, where=unit_setting, quantity=quantity)


def _from_record(path: Path, channels: Sequence[str | int], channels_setting: str) -> tuple[FloatArray, FloatArray]:
    found = read_strong_motion(path)
    names = [item.name for item in found]
    chosen = [found[_place(path, item, names)] for item in channels]
    if not chosen:
        chosen = [item for item in found if not item.vertical]
        remedy = f"name one or two of {', '.join(names)} in {channels_setting}"
        if not chosen:
            raise UserError(path, "", "holds no horizontal channel", remedy)
        if len(chosen) > HORIZONTAL:
            # those of a structure begin anywhere, on the roof too
            problem = (
                f"holds {len(chosen)} horizontal channels, and it is not known which of them are those of the ground"
            )
            raise UserError(path, "", problem, remedy)
    return common_window(path, chosen)


def _column_names(headers: Sequence[str], columns: int) -> list[str]:
    """Return the names of the columns after the time, from the first header with as many; without one the numbers."""
    for line in headers:
        for fields in (re.split(r"[,;\t]", line.lstrip("#% ")), line.lstrip("#% ").split()):
            names = [re.sub(r"\s*[\[(].*", "", field).strip(" \"'") for field in fields]
            if len(names) == columns and all(names) and len(set(names)) == columns:
                return names[1:]
    return [str(number) for number in range(1, columns)]


def _place(path: Path, channel: str | int, names: Sequence[str]) -> int:
    """Return the index of a channel from its name, the number in its name (`3: 90 Deg`), or its position from 1."""
    text = str(channel).strip()
    numbers = [name.partition(":")[0] for name in names]
    for known in (list(names), numbers):
        if known.count(text) == 1:
            return known.index(text)
    if text.isdigit() and 1 <= int(text) <= len(names) and not any(item.isdigit() for item in numbers):
        return int(text) - 1
    raise UserError(path, f"channel {text}", "is not in the record", f"it has {', '.join(names)}")


def _table(path: Path) -> tuple[FloatArray, list[str]]:
    """Return the rows of numbers and the header lines."""
    rows: list[list[float]] = []
    headers: list[str] = []
    lines: list[int] = []
    between: tuple[int, str] | None = None
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words = fields_of(line)
        if not words or not (words[0][0].isdigit() or words[0][0] in "+-."):
            headers.append(line)
            if rows and words and words[0][0] not in "#%":
                between = between or (number, line.strip())
            continue
        if between:
            problem = f"is not a row of numbers ({between[1][:30]!r})"
            raise UserError(path, f"line {between[0]}", problem, "correct the row, or mark it as a comment with #")
        try:
            row = [float(word) for word in words]
        except ValueError as error:
            raise UserError(path, f"line {number}", "has no two numbers", "write time and acceleration") from error
        if len(row) < 2:
            raise UserError(path, f"line {number}", "has no two numbers", "write time and acceleration")
        if rows and len(row) != len(rows[0]):
            problem = f"has {len(row)} numbers, the first row {len(rows[0])}"
            raise UserError(path, f"line {number}", problem, "write time and the same histories in each row")
        rows.append(row)
        lines.append(number)
    if len(rows) < 2:
        raise UserError(path, "", f"holds {len(rows)} rows of numbers", "give at least two")
    table = np.array(rows, dtype=np.float64)
    bad = np.flatnonzero(~np.all(np.isfinite(table), axis=1))
    if bad.size:
        raise UserError(path, f"line {lines[bad[0]]}", "holds a number that is not finite", "give finite numbers")
    _require_clock(path, table[:, 0], lines)
    return table, headers


def _require_clock(path: Path, time_s: FloatArray, lines: Sequence[int]) -> None:
    """Refuse a clock that does not rise or has a gap; `lines` holds the line of each row in the file."""
    steps = np.diff(time_s)
    wrong = np.flatnonzero(~(steps > 0.0))
    if wrong.size:
        raise UserError(
            path, f"line {lines[wrong[0] + 1]}", "time does not rise", "give a strictly rising clock in seconds"
        )
    usual = float(np.median(steps))
    if np.mean(np.abs(steps - usual) < 0.02 * usual) < UNIFORM_SHARE:
        return  # a history of straight lines between times that the user chose
    gap = int(np.argmax(steps))
    if steps[gap] > LONGEST_GAP * usual:
        problem = f"time jumps from {time_s[gap]:g} to {time_s[gap + 1]:g} s, and other rows are {usual:g} s apart"
        raise UserError(path, f"line {lines[gap + 1]}", problem, "fill the gap, or give the part before or after it")


def _require_unit(path: Path, headers: Sequence[str], unit: str, quantity: str, unit_setting: str) -> None:
    """Refuse a unit that a header contradicts, as in `acceleration [g]`."""
    wanted = conversion(unit, where=unit_setting, quantity=quantity)
    for stated in (found.unit for line in headers for found in bracketed_units(line)):
        # a header also states units of other quantities, such as that of the time
        if same_dimension(stated, quantity) and not np.isclose(conversion(stated), wanted, rtol=1e-3):
            problem = f"is not the unit that the header of {path} states"
            raise UserError(unit_setting, unit, problem, f"set it to {stated}")
