"""Strong-motion records as data centres distribute them: CSMIP and COSMOS V2 files, alone or in a zip of CESMD."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, require_size
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError
from mrpipe.units import conversion

_DATA = re.compile(
    r"^\s*(\d+)\s+(?:points\s+of\s+)?(accel|veloc|displ)\w*\.?\s+(?:data|pts|points)\b(.*)$", re.IGNORECASE
)
_STEP = re.compile(r"spaced\s+at\s+([\d.]+)\s*sec", re.IGNORECASE)
_SECONDS = re.compile(r"approx\.?\s+([\d.]+)\s*sec", re.IGNORECASE)
_FORMAT = re.compile(r"\(\s*(\d+)\s*[feg]\s*(\d+)\.\d+\s*\)", re.IGNORECASE)
_UNIT = re.compile(
    r"(?:units?\s*=\s*|in\s+)(cm/s(?:ec)?\^?2|cm/s(?:ec)?/s(?:ec)?|m/s(?:ec)?\^?2|gals?|g)\b", re.IGNORECASE
)
_CHANNEL = re.compile(
    r"\bchan(?:nel)?\.?\s*#?\s*(\d+)\b(?:\s*[:,]\s*([^\n]*?))?(?:\s{3,}|$)", re.IGNORECASE | re.MULTILINE
)
_VERTICAL = re.compile(r"\b(up|vert\w*|dn|down|ud)\b", re.IGNORECASE)
_WIDTH = 10
_RATES_HZ = (50.0, 100.0, 120.0, 125.0, 200.0, 240.0, 250.0, 400.0, 500.0, 1000.0)
ENDINGS = (".v2", ".v2c", ".v1")
LARGEST_ARCHIVE = 2**30


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


def read_strong_motion(path: Path) -> list[StrongMotion]:
    """Return the accelerations of all channels of a V2 file, or of all V2 files in a zip.

    Formats: CSMIP volume 2 (`... points of accel data equally spaced at .005 sec, in cm/sec2`) and COSMOS V1.20
    (`... acceleration pts, approx 36 secs, units=cm/sec2 (04),Format=(8f10.3)`). Velocities and displacements are left
    out.

    Raises
    ------
    UserError
        If no acceleration is found, or a block holds fewer numbers than it promises.
    """
    found: list[StrongMotion] = []
    for text in _texts(path):
        found += _channels(path, text)
    if not found:
        raise UserError(path, "", "holds no acceleration in V2 form", "give a .V2 file, or a zip that contains some")
    names = [item.name for item in found]
    return [
        item if names.count(item.name) == 1 else StrongMotion(f"{item.name} #{index + 1}", *_rest(item))
        for index, item in enumerate(found)
    ]


def _rest(item: StrongMotion) -> tuple[FloatArray, float, bool]:
    return item.acceleration_m_s2, item.interval_s, item.vertical


def _texts(path: Path) -> Iterator[str]:
    if path.suffix.lower() != ".zip":
        yield path.read_text(encoding="latin-1")
        return
    with zipfile.ZipFile(path) as archive:
        members = [item for item in archive.infolist() if Path(item.filename).suffix.lower() in ENDINGS]
        require_size(path, sum(item.file_size for item in members), path.stat().st_size)
        for item in sorted(members, key=lambda member: member.filename):
            yield archive.read(item).decode("latin-1")


def _channels(path: Path, text: str) -> Iterator[StrongMotion]:
    lines = text.splitlines()
    begin = 0
    for index, line in enumerate(lines):
        said = _DATA.match(line)
        if said is None or said[2].lower() != "accel":
            continue
        header = "\n".join(lines[begin:index])
        count = int(said[1])
        values, begin = _numbers(path, lines, index, count, said[3])
        unit = _UNIT.search(said[3])
        named = list(_CHANNEL.finditer(header))
        number = named[-1][1] if named else "1"
        place = (named[-1][2] or "").strip() if named else ""
        yield StrongMotion(
            name=f"{number}: {place}" if place else number,
            acceleration_m_s2=values * conversion(unit[1].lower() if unit else "cm/s^2", quantity="acceleration"),
            interval_s=_interval(path, said[3], header, count),
            vertical=bool(_VERTICAL.search(place)),
        )


def _numbers(path: Path, lines: list[str], index: int, count: int, said: str) -> tuple[FloatArray, int]:
    """Return the numbers of a block in columns of fixed width, and the line after it."""
    form = _FORMAT.search(said)
    width = int(form[2]) if form else _WIDTH
    values: list[float] = []
    row = index + 1
    while len(values) < count and row < len(lines):
        line = lines[row].rstrip()
        pieces = [line[start : start + width] for start in range(0, len(line), width)]
        try:
            values += [float(piece) for piece in pieces if piece.strip()]
        except ValueError:
            break
        row += 1
    if len(values) != count:
        problem = f"promises {count} values, {len(values)} follow"
        raise UserError(path, f"line {index + 1}", problem, "download the record again")
    return np.asarray(values), row


def _interval(path: Path, said: str, header: str, count: int) -> float:
    """Return the sampling interval [s]: stated, else from the length and the real header values of COSMOS."""
    step = _STEP.search(said)
    if step:
        return float(step[1])
    length = _SECONDS.search(said)
    if not length:
        raise UserError(path, "header", "states no sampling interval", "give a V2 file with `spaced at` or `approx`")
    about = float(length[1]) / count
    stated = [float(item) for item in re.findall(r"(?<![\d.])(?:\d+\.\d+|\.\d+)(?![\d.])", header)]
    near = [item for item in stated if abs(item / about - 1.0) < 0.05]
    usual = [1.0 / rate for rate in _RATES_HZ if abs(1.0 / rate / about - 1.0) < 0.05]
    both = [item for item in near if any(abs(item / other - 1.0) < 1e-6 for other in usual)]
    return (both or usual or near or [about])[0]


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    """Return the channels as columns in m/s^2; all must have the clock of the first."""
    channels = read_strong_motion(path)
    interval = channels[0].interval_s
    if any(abs(item.interval_s / interval - 1.0) > 1e-6 for item in channels):
        raise UserError(path, "", "its channels differ in sampling interval", "give the channels in separate files")
    columns = {item.name: item.acceleration_m_s2 for item in channels}
    aliases = {name.partition(":")[0]: name for name in columns}
    length = channels[0].acceleration_m_s2.size
    return DataFile(
        path=path,
        names=tuple(columns),
        fetch=columns.__getitem__,
        time_s=np.asarray(interval * np.arange(length), dtype=np.float64),
        sampling_rate_hz=1.0 / interval,
        aliases=aliases,
    )


READER = Reader((*ENDINGS, ".zip"), _read)
