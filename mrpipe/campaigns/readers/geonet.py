"""Corrected accelerograms of GeoNet, New Zealand (V2A): three components, each with velocity and displacement.

Each component has sixteen lines of text, 40 integers (10I8), 60 reals (10F8), and the samples (10F8): accelerations in
mm/s^2, then velocities and displacements. Source: GNS accelerogram data files, standard format.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.readers.channel_header import since_epoch_s
from mrpipe.campaigns.readers.fortran import required_row
from mrpipe.campaigns.readers.motion import StrongMotion
from mrpipe.errors import UserError

ENDINGS = (".v2a",)

_TEXT_LINES, _INTEGER_LINES, _REAL_LINES, _PER_LINE, _WIDTH = 16, 4, 6, 10, 8
_COUNTS = (33, 34, 35)
_YEAR, _MONTH, _DAY, _HOUR, _MINUTE, _MILLISECONDS = 8, 9, 18, 19, 38, 39
_INTERVAL_S = 25
"""Places in the headers, from 0: numbers of accelerations, velocities and displacements, start, and interval."""
_MM = 1e-3


def geonet_channels(path: Path, text: str) -> Iterator[StrongMotion]:
    """Return the accelerations of all components.

    Parameters
    ----------
    path, text
        The file, for messages, and its content.

    Raises
    ------
    UserError
        If a component has another header or fewer numbers than it promises.
    """
    lines = text.rstrip().splitlines()
    begin, number = 0, 0
    while begin < len(lines):
        number += 1
        if not lines[begin].strip().lower().startswith("corrected accelerogram"):
            problem = f"begins component {number} with {lines[begin].strip()[:40]!r}, not with Corrected accelerogram"
            raise UserError(path, f"line {begin + 1}", problem, "download the record again")
        words = lines[begin + 12].split() if begin + 12 < len(lines) else []
        direction = words[1] if len(words) > 1 else ""
        first = begin + _TEXT_LINES
        integers = _block(path, lines, first, _INTEGER_LINES * _PER_LINE)
        reals = _block(path, lines, first + _INTEGER_LINES, _REAL_LINES * _PER_LINE)
        interval = float(reals[_INTERVAL_S])
        if interval <= 0.0:
            raise UserError(
                path, f"line {first + 7}", f"states the interval {interval:g} s", "download the record again"
            )
        counts = [int(integers[place]) for place in _COUNTS]
        place = first + _INTEGER_LINES + _REAL_LINES
        values = _block(path, lines, place, counts[0])
        yield StrongMotion(
            f"{number}: {direction}" if direction else str(number),
            _MM * values,
            interval,
            direction.lower() in ("up", "down"),
            _start_s(integers),
        )
        begin = place + sum(math.ceil(count / _PER_LINE) for count in counts)


def _block(path: Path, lines: list[str], first: int, count: int) -> FloatArray:
    values: list[float] = []
    for index in range(first, min(first + math.ceil(count / _PER_LINE), len(lines))):
        values += required_row(path, index + 1, lines[index], _WIDTH)
    if len(values) != count or not np.all(np.isfinite(values)):
        problem = f"and the rows after it hold {len(values)} numbers, {count} are promised"
        raise UserError(path, f"line {first + 1}", problem, "download the record again")
    return np.asarray(values, dtype=np.float64)


def _start_s(integers: FloatArray) -> float | None:
    year, month, day, hour, minute = (int(integers[place]) for place in (_YEAR, _MONTH, _DAY, _HOUR, _MINUTE))
    try:
        moment = datetime(year, month, day, hour, minute)
    except ValueError:
        return None
    return since_epoch_s(moment) + 1e-3 * float(integers[_MILLISECONDS])
