"""Strong-motion records in the formats CSMIP V2 and COSMOS V1.20, as data centres distribute them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.readers.channel_header import channel_name, interval_s, is_vertical, start_s
from mrpipe.campaigns.readers.fortran import row_of_numbers
from mrpipe.campaigns.readers.motion import StrongMotion
from mrpipe.errors import UserError
from mrpipe.units import conversion

_DATA = re.compile(
    r"^\s*(\d+)\s+(?:points\s+of\s+)?(?:(?:raw|(?:un)?cor\w*|instr?\w*)[.\s-]+)*"
    r"(accel|veloc|displ)\w*\.?\s+(?:data|pts|points)\b(.*)$",
    re.IGNORECASE,
)
_FORMAT = re.compile(r"\(\s*(?:\d+p,?\s*)?\d*\s*[fegdi]\s*(\d+)(?:\.\d+)?\s*(?:e\d*)?\s*\)", re.IGNORECASE)
"""Fortran format of the samples; some programs write the E of the exponent behind the width."""
_UNIT = re.compile(
    r"(?:units?\s*[=:]\s*|\bin\s+(?:units?\s+of\s+)?)([a-z]+(?:\s*[/^*]\s*[a-z0-9]+|\.[a-z0-9]+)*)", re.IGNORECASE
)
_SHARES_OF_G = {"g/10": 0.1, "mg": 1e-3}
"""Units that only these records use -> their value in g."""
_PEAK_UNIT = re.compile(
    r"(?:peak\s+acceleration|(?<!uncor)(?<!\s)\s+max)\s*=\s*[-+.\d]+\s*([a-z]+(?:/[a-z0-9]+)*)\s*,?\s*at\b",
    re.IGNORECASE,
)
"""Unit of the largest acceleration, which the header states."""
_WIDTH = 10
BLOCK_LINE = "7500 points of accel data equally spaced at .010 sec, in cm/sec2"
"""Line before the samples, for messages."""
ENDINGS = (".v2", ".v2c", ".v1", ".v1c", ".raw")
UNCORRECTED = (".v1", ".v1c", ".raw")
"""Endings of records as the instrument gave them."""
_UNKNOWN = re.compile(r"unknown/unspecified\s*:\s*-?\d+\s*,\s*(-?\d+(?:\.\d*)?)", re.IGNORECASE)
"""Number that stands for an unknown value, as COSMOS states it in its header."""
_PAIRS = re.compile(r"units\s+of\s+uncor\w*\s+\w+\s+are\s+sec\s+and", re.IGNORECASE)


def cosmos_channels(path: Path, text: str) -> Iterator[StrongMotion]:
    """Return the accelerations of all channels of a V1 or V2 file.

    Formats: CSMIP volume 2 (`... points of accel data equally spaced at .005 sec, in cm/sec2`), CSMIP volume 1
    (`... Accelerogram points at 200 pts/sec in units of g . Format: (8f9.6)`) and COSMOS V1.20
    (`... acceleration pts, approx 36 secs, units=cm/sec2 (04),Format=(8f10.3)`). Velocities and displacements are left
    out.

    Parameters
    ----------
    path, text
        The file, for messages, and its content.

    Raises
    ------
    UserError
        If a block holds fewer numbers than it promises, or no acceleration unit.
    """
    lines = text.splitlines()
    begin = 0
    for index, line in enumerate(lines):
        said = _DATA.match(line)
        if said is None or said[2].lower() != "accel":
            continue
        header = "\n".join(lines[begin:index])
        count = int(said[1])
        factor = _factor(path, index + 1, said[3], header)
        values, begin = _numbers(path, lines, index, count, said[3])
        _require_known(path, index + 1, values, header)
        name = channel_name(header)
        yield StrongMotion(
            name=name.text,
            acceleration_m_s2=values * factor,
            interval_s=interval_s(path, said[3], header, count),
            vertical=is_vertical(name, header),
            start_s=start_s(header),
        )


def holds_uneven_pairs(text: str) -> bool:
    """Return whether a file is a digitised film record: pairs of a time and an acceleration, unevenly spaced."""
    return bool(_PAIRS.search(text))


def _factor(path: Path, line: int, said: str, header: str) -> float:
    """Return the factor from the numbers of a block to m/s^2.

    Without a unit before the samples, that of the largest acceleration in the header counts, else cm/s^2, as CSMIP
    writes accelerations.
    """
    unit = _UNIT.search(said) or _PEAK_UNIT.search(header)
    written = re.sub(r"\s", "", unit[1]).lower().rstrip(".") if unit else "cm/s^2"
    if written in _SHARES_OF_G:
        return _SHARES_OF_G[written] * conversion("g", quantity="acceleration")
    try:
        return conversion(written, quantity="acceleration")
    except UserError:
        raise UserError(
            path,
            f"line {line}",
            f"gives the samples in {written}, which is not a unit of acceleration",
            "download the corrected record (volume 2), which is in cm/s^2",
        ) from None


def _require_known(path: Path, line: int, values: FloatArray, header: str) -> None:
    """Refuse samples that are the number which the header states for unknown values.

    One such sample may be a true one in a record that comes as close to this number elsewhere.
    """
    stated = _UNKNOWN.search(header)
    unknown = values == float(stated[1]) if stated else np.zeros(values.size, dtype=bool)
    if not stated or not np.any(unknown):
        return
    largest = float(np.abs(values[~unknown]).max(initial=0.0))
    if np.any(unknown[1:] & unknown[:-1]) or largest < 0.9 * abs(float(stated[1])):
        first, count = int(np.argmax(unknown)) + 1, int(np.sum(unknown))
        problem = (
            f"sample {first} after it is {stated[1]}, which the header states for an unknown value ({count} samples)"
        )
        raise UserError(path, f"line {line}", problem, "download a record without gaps, or cut them off")


def _numbers(path: Path, lines: list[str], index: int, count: int, said: str) -> tuple[FloatArray, int]:
    """Return the numbers of a block, and the line after it: in columns of fixed width, else between blanks."""
    form = _FORMAT.search(said)
    values: list[float] = []
    row, end = index + 1, ""
    while len(values) < count and row < len(lines):
        numbers = row_of_numbers(lines[row], int(form[1]) if form else None)
        numbers = row_of_numbers(lines[row], _WIDTH) if numbers is None else numbers
        if numbers is None:
            end = f"; line {row + 1} is not a row of numbers ({lines[row].strip()[:30]!r})"
            break
        values += numbers
        row += 1
    if len(values) != count:
        problem = f"promises {count} values, {len(values)} follow{end}"
        raise UserError(path, f"line {index + 1}", problem, "download the record again")
    if not np.all(np.isfinite(values)):
        raise UserError(path, f"line {index + 1}", "a sample after it is not finite", "download the record again")
    return np.asarray(values), row
