"""What the header of a channel in a CSMIP or COSMOS file says: number, direction, location, start and interval."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path

from mrpipe.campaigns.readers.fortran import row_of_numbers
from mrpipe.errors import UserError

_LOCATION = r"(?:[^\S\n]*location:[^\S\n]*(?P<location>[^\n]*?))?\s*$"
_CSMIP_CHANNEL = re.compile(
    r"^\s*chan(?:nel)?\.?\s*#?\s*(?P<number>\d+)\s*[:,][^\S\n]*(?P<direction>[^\n(]*?)[^\S\n]*"
    rf"(?:\(sta\s+chn?a?n?:\s*(?P<station>\d+)\))?(?:[^\S\n]{{3,}}(?!\s*location)[^\n]*?)?{_LOCATION}",
    re.IGNORECASE | re.MULTILINE,
)
"""Line 8 of CSMIP: channel of the recorder, direction, channel of the station where it is another, and location."""
_COSMOS_CHANNEL = re.compile(
    r"^\s*sta\s+cha?n?\b\s*:?\s*(?P<number>[\w?]+)\s*:?[^\S\n]*(?P<direction>[^\n(]*?)\s*"
    rf"\((?:rcrdr|recorder)[^)\n]*\){_LOCATION}",
    re.IGNORECASE | re.MULTILINE,
)
"""Line 9 of COSMOS: channel, azimuth and location."""
_ANY_CHANNEL = re.compile(
    r"\bchan(?:nel)?\.?\s*#?\s*(?P<number>\d+)\b(?:\s*[:,]\s*(?P<direction>[^\n]*?))?(?:\s{3,}|$)",
    re.IGNORECASE | re.MULTILINE,
)
_SEISMIC_CODE = re.compile(r"<SCNL>\s*\w+\.(\w+)\.", re.IGNORECASE)
"""Code of the channel (such as HNZ) in the comments of COSMOS: station, channel, network, location."""
_VERTICAL = re.compile(r"\b(up|vert\w*|dn|down|ud|z|v|[a-z][hln]z)\b", re.IGNORECASE)
_STEP = re.compile(r"spaced\s+at\s+([\d.]+)\s*sec", re.IGNORECASE)
_POINTS_RATE = re.compile(r"\bat\s+([\d.]+)\s*(?:pts|points|samples)\s*/\s*sec", re.IGNORECASE)
_SECONDS = re.compile(r"approx\.?\s+([\d.]+)\s*sec", re.IGNORECASE)
_RATE = re.compile(r"([\d.]+)\s*samples/sec", re.IGNORECASE)
_REAL_VALUES = re.compile(r"^\s*(\d+)\s+real-header\s+values\b[^\n]*$", re.IGNORECASE | re.MULTILINE)
_INTEGER_VALUES = re.compile(r"^\s*(\d+)\s+integer-header\s+values\b[^\n]*$", re.IGNORECASE | re.MULTILINE)
_UP, _DOWN, _ANY_VERTICAL = 400, 401, 402
"""Azimuths that COSMOS gives to vertical channels."""
_AZIMUTH, _RECORDED_STEP_S, _STEP_MS = 53, 33, 61
"""Places of the azimuth among the integers, and of sampling intervals among the reals of the header, from 0."""
_RATES_HZ = (50.0, 100.0, 120.0, 125.0, 128.0, 200.0, 240.0, 250.0, 256.0, 400.0, 500.0, 512.0, 1000.0)
_CUT_S = 0.6
"""Duration [s] by which a record may be shorter than COSMOS states, because it rounds or cuts to whole seconds."""
_FIELD_WIDTH = re.compile(r"\(\s*\d*\s*[fegdi]\s*(\d+)", re.IGNORECASE)
"""Width of a number in a Fortran format such as (6F13.6)."""
_START = re.compile(
    r"\b(?:start|trigger)\s+time:\s*(\d+)[/-](\d+)[/-](\d+),?\s+(\d+):\s*(\d+):\s*(\d+(?:\.\d*)?)"
    r"(?:\s+([A-Z]{3})\b)?",
    re.IGNORECASE,
)
_EPOCH = datetime(1900, 1, 1)
"""Starts of records are counted from here."""
_YEAR_DIGITS = 3
"""A first number of the date with as many digits is the year."""
_LAST_CENTURY = 50
"""From this two-digit year on, the year is one of 19xx."""
_BEHIND_UTC_H = {"": 0, "utc": 0, "gmt": 0, "pst": 8, "pdt": 7, "mst": 7, "mdt": 6, "hst": 10}
"""Time zones of the networks -> hours behind UTC."""


@dataclass(frozen=True)
class ChannelName:
    """Number (or code), direction and location of a channel, empty where the header has none."""

    number: str
    direction: str
    location: str

    @property
    def text(self) -> str:
        """The name as it is shown, such as `25: Tran, Bent 4`."""
        place = ", ".join(part for part in (self.direction, self.location) if part)
        return f"{self.number}: {place}" if place else self.number


def channel_name(header: str) -> ChannelName:
    """Return number, direction and location; the number of the station where the recorder has another one."""
    code = _SEISMIC_CODE.search(header)
    for pattern in (_COSMOS_CHANNEL, _CSMIP_CHANNEL, _ANY_CHANNEL):
        found = list(pattern.finditer(header))
        if not found:
            continue
        said = found[-1].groupdict()
        number = said.get("station") or said["number"]
        if "?" in number:
            number = code[1] if code else "1"
        return ChannelName(number, (said["direction"] or "").strip(), (said.get("location") or "").strip())
    return ChannelName(code[1] if code else "1", "", "")


def is_vertical(name: ChannelName, header: str) -> bool:
    """Return whether direction, code or azimuth say that the channel is vertical; the location may not."""
    code = _SEISMIC_CODE.search(header)
    words = f"{name.number} {name.direction} {code[1] if code else ''}"
    integers = _header_values(_INTEGER_VALUES, header)
    azimuth = len(integers) > _AZIMUTH and integers[_AZIMUTH] in (_UP, _DOWN, _ANY_VERTICAL)
    return bool(_VERTICAL.search(words)) or azimuth


def since_epoch_s(moment: datetime) -> float:
    """Return the time [s] from the fixed day on from which starts of records are counted."""
    return (moment - _EPOCH).total_seconds()


def start_s(header: str) -> float | None:
    """Return the start of the record [s] from a fixed day on, None where the header states none."""
    said = _START.search(header)
    if not said:
        return None
    first, second, third, hour, minute = (int(said[place]) for place in range(1, 6))
    year, month, day = (first, second, third) if len(said[1]) > _YEAR_DIGITS else (third, first, second)
    if year < 100:
        year += 1900 if year >= _LAST_CENTURY else 2000
    behind_h = _BEHIND_UTC_H.get((said[7] or "").lower())
    try:
        moment = datetime(year, month, day, hour, minute)
    except ValueError:
        return None
    return None if behind_h is None else since_epoch_s(moment) + 3600.0 * behind_h + float(said[6])


def interval_s(path: Path, said: str, header: str, count: int) -> float:
    """Return the sampling interval [s].

    CSMIP states it in the line before the samples. COSMOS states only a rounded duration there; the first interval of
    the header that agrees with it counts. Where the header leaves the interval out, the usual rate that agrees counts,
    if it is the only one.

    Parameters
    ----------
    path
        The file, for messages.
    said, header
        The line before the samples, and the lines before it.
    count
        Number of samples.

    Raises
    ------
    UserError
        If neither line nor header state an interval, or if they contradict each other.
    """
    step = _STEP.search(said)
    if step and float(step[1]) > 0.0:
        return float(step[1])
    rate = _POINTS_RATE.search(said)
    if rate and float(rate[1]) > 0.0:
        return 1.0 / float(rate[1])
    length = _SECONDS.search(said)
    if not length:
        raise UserError(path, "header", "states no sampling interval", "give a V2 file with `spaced at` or `approx`")
    seconds = float(length[1])
    reals = _header_values(_REAL_VALUES, header)
    # of these samples, then of the record before it was processed
    own = reals[_STEP_MS] * 1e-3 if len(reals) > _STEP_MS else 0.0
    stated = [own]
    stated += [reals[_RECORDED_STEP_S], reals[_RECORDED_STEP_S] * 1e-3] if len(reals) > _RECORDED_STEP_S else []
    stated += [1.0 / float(rate) for rate in reversed(_RATE.findall(header)) if float(rate) > 0.0]
    agrees = partial(_agrees, count=count, seconds=seconds)
    if suitable := list(filter(agrees, stated)):
        return suitable[0]
    about = f"{count} samples in approximately {seconds:g} s"
    if own > 0.0:
        problem = f"states a sampling interval of {own:g} s, but {about}"
        raise UserError(path, f"real header {_STEP_MS + 1}", problem, "correct one of them, or download it again")
    usual = [1.0 / rate for rate in _RATES_HZ if -_CUT_S < count / rate - seconds < 1.0 + _CUT_S]
    if len(usual) != 1:
        problem = f"states no sampling interval, and {about} do not determine it"
        remedy = "write the interval in ms as this number of the header"
        raise UserError(path, f"real header {_STEP_MS + 1}", problem, remedy)
    return usual[0]


def _agrees(interval: float, count: int, seconds: float) -> bool:
    return interval > 0.0 and abs(interval * count - seconds) <= max(1.0, 0.01 * seconds)


def _header_values(heading: re.Pattern[str], header: str) -> list[float]:
    """Return the numbers that follow a heading of COSMOS, such as `100 Real-header values follow on 20 lines`."""
    found = list(heading.finditer(header))
    if not found:
        return []
    count = int(found[-1][1])
    width = _FIELD_WIDTH.search(found[-1][0])
    values: list[float] = []
    for line in header[found[-1].end() :].splitlines()[1:]:
        # a large number fills its columns, so that it touches the one before it
        numbers = row_of_numbers(line, int(width[1]) if width else None)
        if numbers is None or len(values) >= count:
            break
        values += numbers
    return values[:count]
