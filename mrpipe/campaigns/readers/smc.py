"""Strong-motion records in SMC form, as the US Geological Survey distributes them: one component a file.

Eleven lines of text, 48 integers (8I10), 50 reals (5E15.7), comments, and the samples (8E10.4, or 5E14.7 where integer
47 says so); accelerations in cm/s^2. Source: National Strong-Motion Project, SMC- and BBF-format data files.
"""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.readers.channel_header import since_epoch_s
from mrpipe.campaigns.readers.fortran import required_row, row_of_numbers
from mrpipe.campaigns.readers.motion import StrongMotion
from mrpipe.errors import UserError

ENDINGS = (".smc",)

_TEXT_LINES, _INTEGER_LINES, _REAL_LINES = 11, 6, 10
_INTEGER_WIDTH, _REAL_WIDTH, _WIDTH, _FINE_WIDTH = 10, 15, 10, 14
_INTEGERS, _REALS = 48, 50
_NOT_GIVEN = -32768
_LARGEST_RATE_HZ = 1e5
"""A larger real number stands for one that is not given."""
_YEAR, _DAY, _HOUR, _MINUTE, _SECOND, _MILLISECOND = 1, 2, 3, 4, 5, 6
_CHANNEL, _FROM_VERTICAL, _AZIMUTH, _COMMENTS, _COUNT, _PRECISION = 8, 12, 13, 15, 16, 46
_RATE = 1
"""Places of the headers that are used, from 0."""
_HORIZONTAL = 90
_COMPONENT = re.compile(r"component\s*=\s*(\w+)", re.IGNORECASE)
_STATION = re.compile(r"station\s*=\s*(.*?)\s*(?:component|$)", re.IGNORECASE)
_CM = 0.01


def smc_record(path: Path, text: str) -> StrongMotion:
    """Return the acceleration of an SMC file.

    Parameters
    ----------
    path, text
        The file, for messages, and its content.

    Raises
    ------
    UserError
        If it holds another quantity, samples at uneven times, or fewer samples than it promises.
    """
    lines = text.splitlines()
    kind = lines[0].strip().upper() if lines else ""
    if "ACCELEROGRAM" not in kind:
        problem = f"begins with {kind[:40]!r} and holds no accelerogram"
        raise UserError(path, "line 1", problem, "give the file of the corrected accelerogram")
    begin = _TEXT_LINES + _INTEGER_LINES
    whole = _header(path, lines, _TEXT_LINES, _INTEGER_LINES, _INTEGER_WIDTH, _INTEGERS)
    reals = _header(path, lines, begin, _REAL_LINES, _REAL_WIDTH, _REALS)
    integers = [int(value) for value in whole]
    rate, count = reals[_RATE], integers[_COUNT]
    if not 0.0 < rate < _LARGEST_RATE_HZ:
        problem = "states no sampling rate: its samples are pairs of time and acceleration at uneven times"
        raise UserError(path, "real header 2", problem, "download the corrected record")
    first = begin + _REAL_LINES + max(integers[_COMMENTS], 0)
    width = _WIDTH if integers[_PRECISION] == _NOT_GIVEN else _FINE_WIDTH
    values = _samples(path, lines[first:], first, count, width)
    vertical = integers[_FROM_VERTICAL] not in (_HORIZONTAL, _NOT_GIVEN)
    return StrongMotion(_name(lines, integers), _CM * values, 1.0 / rate, vertical, _start_s(integers))


def _header(path: Path, lines: list[str], first: int, rows: int, width: int, count: int) -> list[float]:
    found: list[float] = []
    for index in range(first, first + rows):
        row = row_of_numbers(lines[index], width) if index < len(lines) else None
        if row is None:
            raise UserError(path, f"line {index + 1}", "is not a row of the header in SMC form", "download it again")
        found += row
    if len(found) != count:
        problem = f"and the rows after it hold {len(found)} numbers of the header, {count} are expected"
        raise UserError(path, f"line {first + 1}", problem, "download the record again")
    return found


def _samples(path: Path, lines: list[str], first: int, count: int, width: int) -> FloatArray:
    values: list[float] = []
    for number, line in enumerate(lines, start=first + 1):
        if len(values) >= count or not line.strip():
            break
        values += required_row(path, number, line, width)
    if len(values) != count or not np.all(np.isfinite(values)):
        problem = f"promises {count} finite samples, {int(np.sum(np.isfinite(values)))} follow"
        raise UserError(path, "integer header 17", problem, "download the record again")
    return np.asarray(values, dtype=np.float64)


def _name(lines: list[str], integers: list[int]) -> str:
    """Return channel, direction and station, such as `1: 360 Deg, San Francisco`."""
    said = "\n".join(lines[1:_TEXT_LINES])
    component, station = _COMPONENT.search(said), _STATION.search(said)
    known = integers[_AZIMUTH] != _NOT_GIVEN and integers[_FROM_VERTICAL] in (_HORIZONTAL, _NOT_GIVEN)
    direction = f"{integers[_AZIMUTH]} Deg" if known else component[1] if component else ""
    channel = str(integers[_CHANNEL]) if integers[_CHANNEL] > 0 else "1"
    where = " ".join(station[1].split()) if station else ""
    place = ", ".join(part for part in (direction, where) if part)
    return f"{channel}: {place}" if place else channel


def _start_s(integers: list[int]) -> float | None:
    """Return the start of the record [s] from a fixed day on; None where a part of it is not given."""
    parts = [integers[place] for place in (_YEAR, _DAY, _HOUR, _MINUTE, _SECOND, _MILLISECOND)]
    if _NOT_GIVEN in parts or parts[0] <= 0:
        return None
    year, day, hour, minute, second, millisecond = parts
    moment = datetime(year, 1, 1) + timedelta(days=day - 1, hours=hour, minutes=minute, seconds=second)
    return since_epoch_s(moment) + 1e-3 * millisecond
