"""A data file as named columns, and the selection of a column."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.artifacts.yaml_source import nearest
from mrpipe.errors import UserError
from mrpipe.words import listed

NUMERIC_IN_MATLAB = (
    "save each signal in MATLAB as a numeric vector or as a field of a structure, because cell arrays, tables and "
    "timetables cannot be read"
)
"""Remedy for a variable of MATLAB without an array of numbers."""

_INDEXED = re.compile(r"^(?P<name>.*?)\s*\[(?P<index>[^\]]*)\]$")


def _plain(name: str) -> str:
    """Return a name in which spellings that look the same are the same, such as those of an umlaut and of micro."""
    return " ".join(unicodedata.normalize("NFKC", name).split())


@dataclass(frozen=True)
class DataFile:
    """Columns that a reader found in a file.

    Attributes
    ----------
    path
        The file.
    names
        Names of the columns that can be read.
    fetch
        Name -> array of numbers (any shape); called only for columns that are used.
    table
        Whether an integer selects a column by position.
    time_s, sampling_rate_hz
        Clock in the file (data loggers, UFF), shape (n,) [s] and rate [Hz]; None if it has none.
    parts
        Half-open index ranges between the pauses of a logger; empty if there are none.
    first_row
        Line of the first sample in a text file, 0 where lines mean nothing.
    row_lines
        Line of each sample in a text file where other lines stand between them, else empty.
    aliases
        Other spellings of a name.
    headers
        Header lines of a text file, one word per column; empty for other formats.
    units
        Column -> unit as the file states it next to the name (TDMS, MDF, HDF5); columns without one are left out.
    clocks
        Column -> start [s], interval [s] and number of samples of its clock, where each column of a file has its own.
    accelerations
        Columns that are known to be accelerations [m/s^2], as those of strong-motion records are: name -> whether
        horizontal.
    notes
        What the reader left out, one line each, for a proposal.
    separator
        Sign between a group and a column in the names, where it is not that of paths.
    """

    path: Path
    names: tuple[str, ...]
    fetch: Callable[[str], Any]
    table: bool = False
    time_s: FloatArray | None = None
    sampling_rate_hz: float | None = None
    parts: tuple[tuple[int, int], ...] = ()
    first_row: int = 0
    row_lines: tuple[int, ...] = ()
    aliases: Mapping[str, str] = field(default_factory=dict)
    headers: tuple[tuple[str, ...], ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    clocks: Mapping[str, tuple[float, float, int]] = field(default_factory=dict)
    accelerations: Mapping[str, bool] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    separator: str = ""

    def line_of(self, sample: int) -> int:
        """Return the line of a sample in a text file, for messages; its number from 0 where lines mean nothing."""
        return self.row_lines[sample] if sample < len(self.row_lines) else self.first_row + sample

    def with_clock_of(self, columns: Iterable[str | int]) -> DataFile:
        """Return the file with the clock of these columns as its own, where each column has a clock and they agree.

        Raises
        ------
        UserError
            If there is no such column.
        """
        if not self.clocks:
            return self
        clocks = {self.clocks.get(self._resolve(column, "")[0]) for column in columns}
        clock = next(iter(clocks)) if len(clocks) == 1 else None
        if clock is None:
            return replace(self, time_s=None, sampling_rate_hz=None)
        start, step, count = clock
        time: FloatArray = np.asarray(start + step * np.arange(count), dtype=np.float64)
        # the rate that other formats get from such a clock, to the last digit
        rate = 1.0 / float(np.median(np.diff(time))) if count > 1 else 1.0 / step
        return replace(self, time_s=time, sampling_rate_hz=rate)

    def column(self, column: str | int, where: str) -> FloatArray:
        """Return one column, shape (n,).

        `column` is a name, an index of a table (from 0), or a name with an index such as `x_F[:,2]`.

        Raises
        ------
        UserError
            If there is no such column, or if it is not a vector of numbers.
        """
        name, index = self._resolve(column, where)
        try:
            values = self.fetch(name)
        except UserError:
            raise
        except Exception as error:
            said = " ".join(str(error).split())[:200] or type(error).__name__
            raise UserError(
                self.path, where, f"column {column!r} cannot be read ({said})", "export it again"
            ) from error
        if isinstance(values, UserError):
            raise values
        array = np.asarray(values)
        if array.dtype.kind not in "fiub":
            raise UserError(self.path, where, f"column {column!r} holds no numbers", self._remedy_of(array.dtype.kind))
        array = array.astype(np.float64)
        if index is not None:
            array = self._pick(array, index, column, where)
        array = np.squeeze(array)
        if array.ndim == 0 and self.table:
            raise UserError(self.path, where, "holds a single row of numbers", "a recording needs at least two samples")
        if array.ndim == 0:
            remedy = (
                "name a variable with one number a sample; for a sampling interval give sampling_rate_hz in its place"
            )
            raise UserError(self.path, where, f"column {column!r} holds one number", remedy)
        if array.ndim != 1 or array.size < 2:
            shape = " x ".join(map(str, array.shape)) or "one number"
            raise UserError(
                self.path, where, f"column {column!r} is not a vector ({shape})", f"pick one column, as in {name}[:,0]"
            )
        return np.ascontiguousarray(array)

    def _remedy_of(self, kind: str) -> str:
        """Return what to do about values of another kind (letter of numpy) than real numbers."""
        if kind == "c":
            return "they are complex: store the real part"
        if self.path.suffix.lower() == ".mat":
            return NUMERIC_IN_MATLAB
        return "name a column of numbers, and write numbers without quotes"

    def _resolve(self, column: str | int, where: str) -> tuple[str, str | None]:
        if isinstance(column, str) and not isinstance(column, bool):
            if column in self.names:
                return column, None
            if column in self.aliases:
                return self.aliases[column], None
            match = _INDEXED.match(column)
            indexed = self.aliases.get(match["name"], match["name"]) if match else ""
            if match and indexed in self.names:
                return indexed, match["index"]
            if self.table and match and not match["name"]:
                column = match["index"].split(",")[-1].strip()
            alike = [name for name in self.names if _plain(name) == _plain(column)]
            if len(alike) == 1:
                return alike[0], None
        if self.table and re.fullmatch(r"-?\d+", str(column)):
            position = int(column)
            if -len(self.names) <= position < len(self.names):
                return self.names[position], None
            raise UserError(
                self.path,
                where,
                f"no column {position}, the table has {len(self.names)}",
                f"count from 0 to {len(self.names) - 1}",
            )
        if self.path.suffix.lower() != ".csv" and len(self.names) == 1 and isinstance(column, int):
            return self.names[0], f":,{column}"
        asked = str(column).split("[")[0]
        raise UserError(self.path, where, f"no column {column!r}", nearest(asked, self.names))

    def require_one(self, column: str | int, array: FloatArray, where: str) -> None:
        """Refuse a name that several columns of a table have, unless all of them hold the same numbers.

        Parameters
        ----------
        column
            Name that the campaign gives; a position is never refused.
        array
            Numbers of this column, shape (n,).
        where
            Test and channel, for the message.

        Raises
        ------
        UserError
            If the numbers differ.
        """
        name = self._resolve(column, where)[0]
        if not isinstance(column, str) or _plain(column) != _plain(name):
            return
        places = [place for place, other in enumerate(self.names) if other == name or other.startswith(f"{name}#")]
        if not self.table or len(places) < 2:
            return
        for place in places:
            other = self.fetch(self.names[place])
            if not isinstance(other, UserError) and not np.array_equal(np.asarray(other), array, equal_nan=True):
                said = listed([str(place) for place in places])
                remedy = f"name the right one by its position, counted from 0, as in column: {places[0]}"
                raise UserError(self.path, where, f"columns {said} have the name {name!r}", remedy)

    def _pick(self, array: FloatArray, index: str, column: str | int, where: str) -> FloatArray:
        parts: list[Any] = []
        for part in index.split(","):
            text = part.strip()
            if text == ":":
                parts.append(slice(None))
            elif re.fullmatch(r"-?\d+", text):
                parts.append(int(text))
            else:
                raise UserError(self.path, where, f"index [{index}] is not understood", "write one such as [:,2]")
        try:
            return np.asarray(array[tuple(parts)])
        except IndexError:
            shape = " x ".join(map(str, array.shape))
            raise UserError(
                self.path, where, f"column {column!r} lies outside an array of {shape}", "count from 0"
            ) from None
