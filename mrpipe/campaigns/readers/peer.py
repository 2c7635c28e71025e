"""Records of the PEER data base (AT2): four lines of header, then five accelerations in a line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.readers.fortran import required_row, row_of_numbers
from mrpipe.errors import UserError
from mrpipe.units import same_dimension

ENDINGS = (".at2",)

_POINTS = re.compile(r"NPTS\s*[=:]\s*(\d+)", re.IGNORECASE)
_INTERVAL = re.compile(r"\bDT\s*[=:]\s*([0-9.]+(?:E[-+]?\d+)?)", re.IGNORECASE)
_OLD_HEADER = re.compile(r"^\s*(\d+)\s+([0-9.]+(?:E[-+]?\d+)?)\s+NPTS\s*,\s*DT", re.IGNORECASE | re.MULTILINE)
_WORDS_OF_UNIT = r"([a-z]+(?:/[a-z0-9^*]+)*)"
_UNIT = re.compile(rf"units?\s+of\s+{_WORDS_OF_UNIT}", re.IGNORECASE)
_OTHER_UNIT = re.compile(rf"(?:\bin\s+|[(\[]\s*|units?\s*(?:are|is|[=:])\s*){_WORDS_OF_UNIT}", re.IGNORECASE)
"""Unit as other programs state it: `Acceleration in cm/s/s`, `The units are (g)`."""
_OTHER_QUANTITY = re.compile(r"\b(velocity|displacement)\b", re.IGNORECASE)
_VERTICAL = re.compile(
    r"(?:[-_.](?:up|down|dwn|ver|vert|v|z)|up|dwn|[a-z][hln]z|ver|(?<![a-z])(?:ud|dn))$", re.IGNORECASE
)
_VERTICAL_COMPONENT = re.compile(r"^(?:up|ud|dn|dwn|down|v|ver\w*|z|[a-z]{2}z)$", re.IGNORECASE)
"""Component in the second line of the header, such as `KOBE 01/16/95 2046, NISHI-AKASHI, UP (CUE)`."""
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
    component
        Direction that the second line states, such as `090` or `UP`; empty where it states none.
    """

    samples: FloatArray
    interval_s: float
    header: str
    unit: str
    component: str = ""


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
        If the header has no NPTS and DT or states another quantity, a row holds other things than numbers, or NPTS is
        wrong.
    """
    # programs of DOS end a text with this character
    lines = text.replace("\x1a", "").splitlines()
    first = next((i for i, line in enumerate(lines) if i >= _HEADER_LINES and row_of_numbers(line)), len(lines))
    header = "\n".join(lines[:first])
    old, points, interval = _OLD_HEADER.search(header), _POINTS.search(header), _INTERVAL.search(header)
    count = int(points[1]) if points else int(old[1]) if old else None
    step = float(interval[1]) if interval else float(old[2]) if old else None
    if count is None or step is None:
        raise UserError(path, "header", "has no NPTS and DT", "an AT2 file says NPTS= 1234, DT= .0050 SEC in line 4")
    if step <= 0.0:
        raise UserError(path, "DT", f"is {step:g} s", "correct the sampling interval in the header")
    samples: list[float] = []
    longest = 0
    for number, line in enumerate(lines[first:], start=first + 1):
        row = required_row(path, number, line, remedy="leave text to the header lines, or download it again")
        samples.extend(row)
        longest = max(longest, len(row))
    # some programs fill the last row with zeros
    if count < len(samples) < count + longest and not any(samples[count:]):
        samples = samples[:count]
    if len(samples) != count:
        raise UserError(
            path, "NPTS", f"promises {count} points, the file holds {len(samples)}", "correct the header or the file"
        )
    if not np.all(np.isfinite(samples)):
        raise UserError(path, "", "holds a sample that is not finite", "download the record again")
    component = re.sub(r"\(.*", "", lines[1]).rpartition(",")[2].strip()
    return PeerRecord(np.array(samples), step, header, _unit(path, lines[_HEADER_LINES:first]), component)


def _unit(path: Path, lines: list[str]) -> str:
    """Return the unit that the lines between the names and the samples state."""
    text = "\n".join(lines)
    if (other := _OTHER_QUANTITY.search(text)) and "accel" not in text.lower():
        problem = f"says that this is not an acceleration, but a {other[1].lower()}"
        raise UserError(path, "header", problem, "give the .AT2 file of the acceleration")
    if unit := _UNIT.search(text):
        return unit[1].lower()
    stated = (found[1].lower() for found in _OTHER_UNIT.finditer(text))
    return next((unit for unit in stated if _is_acceleration(unit)), "g")


def _is_acceleration(unit: str) -> bool:
    try:
        return same_dimension(unit, "acceleration")
    except UserError:
        return False


def is_vertical(name: str, component: str = "") -> bool:
    """Return whether a component is vertical.

    Parameters
    ----------
    name
        Name of the file without its ending, such as `I-ELC-UP`.
    component
        Direction that the header states.
    """
    return bool(_VERTICAL.search(name) or _VERTICAL_COMPONENT.match(component))
