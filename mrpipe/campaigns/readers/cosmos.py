"""Strong-motion records in the formats CSMIP V2 and COSMOS V1.20, as data centres distribute them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.units import conversion

_DATA = re.compile(
    r"^\s*(\d+)\s+(?:points\s+of\s+)?(?:(?:raw|(?:un)?cor\w*|instr?\w*)[.\s-]+)*"
    r"(accel|veloc|displ)\w*\.?\s+(?:data|pts|points)\b(.*)$",
    re.IGNORECASE,
)
_STEP = re.compile(r"spaced\s+at\s+([\d.]+)\s*sec", re.IGNORECASE)
_POINTS_RATE = re.compile(r"\bat\s+([\d.]+)\s*(?:pts|points|samples)\s*/\s*sec", re.IGNORECASE)
_SECONDS = re.compile(r"approx\.?\s+([\d.]+)\s*sec", re.IGNORECASE)
_RATE = re.compile(r"([\d.]+)\s*samples/sec", re.IGNORECASE)
_REAL_VALUES = re.compile(r"^\s*(\d+)\s+real-header\s+values\b[^\n]*$", re.IGNORECASE | re.MULTILINE)
_INTEGER_VALUES = re.compile(r"^\s*(\d+)\s+integer-header\s+values\b[^\n]*$", re.IGNORECASE | re.MULTILINE)
_FORMAT = re.compile(r"\(\s*(?:\d+p,?\s*)?\d*\s*[fegdi]\s*(\d+)(?:\.\d+)?\s*(?:e\d*)?\s*\)", re.IGNORECASE)
"""Fortran format of the samples; some programs write the E of the exponent behind the width."""
_UNIT = re.compile(
    r"(?:units?\s*=\s*|\bin\s+(?:units?\s+of\s+)?)([a-z]+(?:\s*[/^*]\s*[a-z0-9]+|\.[a-z0-9]+)*)", re.IGNORECASE
)
_TENTH_OF_G = "g/10"
_CHANNEL = re.compile(
    r"\bchan(?:nel)?\.?\s*#?\s*(\d+)\b(?:\s*[:,]\s*([^\n]*?))?(?:\s{3,}|$)", re.IGNORECASE | re.MULTILINE
)
_STATION_CHANNEL = re.compile(
    r"^\s*sta\s+chan?\b\s*:?\s*(\w+)\s*:?\s*([^\n(]*?)\s*\((?:rcrdr|recorder)[^)\n]*\)"
    r"(?:[^\S\n]*location:[^\S\n]*([^\n]*?))?\s*$",
    re.IGNORECASE | re.MULTILINE,
)
"""Line 9 of COSMOS: channel, azimuth and location."""
_VERTICAL = re.compile(r"\b(up|vert\w*|dn|down|ud|[a-z]nz)\b", re.IGNORECASE)
_UP, _DOWN, _ANY_VERTICAL = 400, 401, 402
"""Azimuths that COSMOS gives to vertical channels."""
_AZIMUTH, _RECORDED_STEP_S, _STEP_MS = 53, 33, 61
"""Places of the azimuth among the integers, and of sampling intervals among the reals of the header, from 0."""
_WIDTH = 10
_RATES_HZ = (50.0, 100.0, 120.0, 125.0, 200.0, 240.0, 250.0, 400.0, 500.0, 1000.0)
ENDINGS = (".v2", ".v2c", ".v1", ".v1c")


@dataclass(frozen=True)
class StrongMotion:
    """Acceleration of one channel.

    Attributes
    ----------
    name
        Number and place or direction as the header gives them, such as `3: 90 Deg`.
    acceleration_m_s2
        Shape (n,).
    interval_s
        Sampling interval [s].
    vertical
        Whether the header calls the channel vertical.
    """

    name: str
    acceleration_m_s2: FloatArray
    interval_s: float
    vertical: bool


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
        factor = _factor(path, index + 1, said[3])
        values, begin = _numbers(path, lines, index, count, said[3])
        number, place = _name(header)
        yield StrongMotion(
            name=f"{number}: {place}" if place else number,
            acceleration_m_s2=values * factor,
            interval_s=_interval(path, said[3], header, count),
            vertical=bool(_VERTICAL.search(f"{number} {place}")) or _is_vertical(header),
        )


def _name(header: str) -> tuple[str, str]:
    """Return number (or code) of the channel and its direction and location, as the header gives them."""
    station = list(_STATION_CHANNEL.finditer(header))
    if station:
        return station[-1][1], ", ".join(part for part in (station[-1][2], station[-1][3]) if part)
    named = list(_CHANNEL.finditer(header))
    return (named[-1][1], (named[-1][2] or "").strip()) if named else ("1", "")


def _factor(path: Path, line: int, said: str) -> float:
    """Return the factor from the numbers of a block to m/s^2; without a unit they are cm/s^2, as CSMIP writes them."""
    unit = _UNIT.search(said)
    written = re.sub(r"\s", "", unit[1]).lower().rstrip(".") if unit else "cm/s^2"
    if written == _TENTH_OF_G:
        return 0.1 * conversion("g", quantity="acceleration")
    try:
        return conversion(written, quantity="acceleration")
    except UserError:
        raise UserError(
            path,
            f"line {line}",
            f"gives the samples in {written}, which is not a unit of acceleration",
            "download the corrected record (volume 2), which is in cm/s^2",
        ) from None


def _numbers(path: Path, lines: list[str], index: int, count: int, said: str) -> tuple[FloatArray, int]:
    """Return the numbers of a block, and the line after it: in columns of fixed width, else between blanks."""
    form = _FORMAT.search(said)
    width = int(form[1]) if form else _WIDTH
    values: list[float] = []
    row = index + 1
    while len(values) < count and row < len(lines):
        line = lines[row].rstrip()
        numbers = _floats(line[start : start + width] for start in range(0, len(line), width))
        numbers = _floats(line.split()) if numbers is None else numbers
        if numbers is None:
            break
        values += numbers
        row += 1
    if len(values) != count:
        problem = f"promises {count} values, {len(values)} follow"
        raise UserError(path, f"line {index + 1}", problem, "download the record again")
    return np.asarray(values), row


def _floats(pieces: Iterable[str]) -> list[float] | None:
    try:
        return [float(piece) for piece in pieces if piece.strip()]
    except ValueError:
        return None


def _interval(path: Path, said: str, header: str, count: int) -> float:
    """Return the sampling interval [s].

    CSMIP states it in the line before the samples. COSMOS states only a rounded duration there; the first interval of
    the header that agrees with it counts, and without one the usual rate that agrees.
    """
    step = _STEP.search(said)
    if step:
        return float(step[1])
    rate = _POINTS_RATE.search(said)
    if rate and float(rate[1]) > 0.0:
        return 1.0 / float(rate[1])
    length = _SECONDS.search(said)
    if not length:
        raise UserError(path, "header", "states no sampling interval", "give a V2 file with `spaced at` or `approx`")
    seconds = float(length[1])
    reals = _header_values(_REAL_VALUES, header)
    stated = [reals[_STEP_MS] * 1e-3] if len(reals) > _STEP_MS else []
    stated += [reals[_RECORDED_STEP_S], reals[_RECORDED_STEP_S] * 1e-3] if len(reals) > _RECORDED_STEP_S else []
    stated += [1.0 / float(rate) for rate in reversed(_RATE.findall(header)) if float(rate) > 0.0]
    # the duration is rounded or cut to whole seconds
    agrees = partial(_agrees, count=count, seconds=seconds)
    for candidates in (
        stated,
        sorted((1.0 / rate for rate in _RATES_HZ), key=lambda item: abs(item * count - seconds)),
    ):
        if suitable := list(filter(agrees, candidates)):
            return suitable[0]
    return seconds / count


def _agrees(interval_s: float, count: int, seconds: float) -> bool:
    return interval_s > 0.0 and abs(interval_s * count - seconds) <= max(1.0, 0.01 * seconds)


def _header_values(heading: re.Pattern[str], header: str) -> list[float]:
    """Return the numbers that follow a heading of COSMOS, such as `100 Real-header values follow on 20 lines`."""
    found = list(heading.finditer(header))
    if not found:
        return []
    count = int(found[-1][1])
    values: list[float] = []
    for line in header[found[-1].end() :].splitlines()[1:]:
        numbers = _floats(line.split())
        if numbers is None or len(values) >= count:
            break
        values += numbers
    return values[:count]


def _is_vertical(header: str) -> bool:
    integers = _header_values(_INTEGER_VALUES, header)
    return len(integers) > _AZIMUTH and integers[_AZIMUTH] in (_UP, _DOWN, _ANY_VERTICAL)
