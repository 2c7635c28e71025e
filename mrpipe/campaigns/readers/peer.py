"""Records of the PEER data base (AT2): four lines of header, then five accelerations in a line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError

ENDINGS = (".at2",)
INTEGRATED = {".vt2": "velocity", ".dt2": "displacement"}
"""Endings of the records that PEER integrates from the acceleration, and what they hold."""

_POINTS = re.compile(r"NPTS\s*[=:]\s*(\d+)", re.IGNORECASE)
_INTERVAL = re.compile(r"\bDT\s*[=:]\s*([0-9.]+(?:E[-+]?\d+)?)", re.IGNORECASE)
_OLD_HEADER = re.compile(r"^\s*(\d+)\s+([0-9.]+(?:E[-+]?\d+)?)\s+NPTS\s*,\s*DT", re.IGNORECASE | re.MULTILINE)
_UNIT = re.compile(r"units?\s+of\s+([a-z]+(?:/[a-z0-9^*]+)*)", re.IGNORECASE)
_VERTICAL = re.compile(r"(?:[-_](?:up|down|dwn|ver|vert|v)|up|dwn|[a-z]nz|ver)$", re.IGNORECASE)
_HEADER_LINES = 2
"""The first lines are names, which may begin with a number."""


@dataclass(frozen=True)
class PeerRecord:
    """A record as it stands in the file.

    Attributes
    ----------
    samples
        Shape (n,), in the unit of the file.
    interval_s
        Sampling interval [s].
    header
        The lines before the samples.
    unit
        Unit that the header states; g where it states none, because PEER writes accelerations in g.
    """

    samples: FloatArray
    interval_s: float
    header: str
    unit: str


def peer_record(path: Path, text: str) -> PeerRecord:
    """Return the record that an AT2 file holds.

    Headers `NPTS= 4000, DT= .0050 SEC` (NGA-West2) and `4000 0.0050 NPTS, DT` (NGA-West1) are known.

    Parameters
    ----------
    path, text
        The file, for messages, and its content.

    Raises
    ------
    UserError
        If the header has no NPTS and DT, a row holds other things than numbers, or NPTS is wrong.
    """
    lines = text.splitlines()
    first = next((i for i, line in enumerate(lines) if i >= _HEADER_LINES and _row(line)), len(lines))
    header = "\n".join(lines[:first])
    old, points, interval = _OLD_HEADER.search(header), _POINTS.search(header), _INTERVAL.search(header)
    count = int(points[1]) if points else int(old[1]) if old else None
    step = float(interval[1]) if interval else float(old[2]) if old else None
    if count is None or step is None:
        raise UserError(path, "header", "has no NPTS and DT", "an AT2 file says NPTS= 1234, DT= .0050 SEC in line 4")
    samples: list[float] = []
    for number, line in enumerate(lines[first:], start=first + 1):
        row = _row(line)
        if row is None:
            raise UserError(path, f"line {number}", "is not a row of numbers", "leave text to the four header lines")
        samples.extend(row)
    if len(samples) != count:
        raise UserError(
            path, "NPTS", f"promises {count} points, the file holds {len(samples)}", "correct the header or the file"
        )
    unit = _UNIT.search(header)
    return PeerRecord(np.array(samples), step, header, unit[1].lower() if unit else "g")


def is_vertical(name: str) -> bool:
    """Return whether the name of a file without its ending says that the component is vertical, as `I-ELC-UP` does."""
    return bool(_VERTICAL.search(name))


def refuse_integrated(path: Path) -> None:
    """Refuse a record of velocity or displacement.

    Raises
    ------
    UserError
        If the ending is that of such a record.
    """
    ending = path.suffix.lower()
    if ending in INTEGRATED:
        raise UserError(path, "", f"is a record of {INTEGRATED[ending]}", "give the .AT2 file of the same component")


def _row(line: str) -> list[float] | None:
    try:
        return [float(field) for field in line.replace(",", " ").split()]
    except ValueError:
        return None
