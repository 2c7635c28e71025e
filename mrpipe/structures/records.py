"""Ground-motion records: PEER AT2, CSMIP and COSMOS V2 (also zipped), text, csv and MATLAB; g, cm/s^2 or m/s^2.

Every record is checked: finite samples, uniform times that agree with the header, the number of points of the header,
and peaks that are plausible for a ground motion in the stated unit.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.signal import resample_poly

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.readers.peer import peer_record
from mrpipe.campaigns.readers.row import fields_of
from mrpipe.campaigns.readers.strong_motion import (
    ENDINGS,
    common_window,
    read_strong_motion,
    refuse_other_records,
)
from mrpipe.errors import UserError
from mrpipe.units import to_si
from mrpipe.words import listed

GRAVITY = 9.80665
SMALLEST_PEAK, LARGEST_PEAK = 0.05 * GRAVITY, 1.5 * GRAVITY
"""Peaks [m/s^2] from which the unit of a record is inferred if the record does not state it."""
IMPOSSIBLE_PEAK = 3.0 * GRAVITY
"""Peak above which a record is refused [m/s^2]; no recorded ground motion exceeds it."""

_UNITS = (
    (re.compile(r"units?\s+of\s+g\b|\(g\)|\[g\]|\bin\s+g\b|,\s*g\s*$|^\s*g\s*$", re.IGNORECASE | re.MULTILINE), "g"),
    (re.compile(r"cm[/_]s(ec)?\s*(/s(ec)?|\^?2|2|\*\*2)|\bgals?\b", re.IGNORECASE), "cm/s^2"),
    (re.compile(r"(?<![a-z])m[/_]s(ec)?\s*(/s(ec)?|\^?2|2|\*\*2)", re.IGNORECASE), "m/s^2"),
)
_UNIT_COLUMN = re.compile(r"[\[(]\s*([^\[\]()]*/\s*s(?:ec)?(?![a-z])[^\[\]()]*)[\])]", re.IGNORECASE)
"""Pattern of a unit in brackets per second or per second squared, which marks a column that is not time."""
_OTHER_QUANTITY = re.compile(r"\b(velocity|displacement)\b[^\n]*\bunits?\s+of\b", re.IGNORECASE)
_FOREIGN = (".json", ".xlsx", ".xls", ".h5", ".hdf5", ".pdf", ".png", ".jpg", ".npz", ".npy")
_CLOCK_NAME = re.compile(r"^\W*(t|time|zeit)\b", re.IGNORECASE)
_ADVICE = "give its unit, as --set benchmark.base_isolated.motion.unit=g (or ten_storey)"
_POINTS = re.compile(r"NPTS\s*[=:]\s*(\d+)", re.IGNORECASE)
_INTERVAL = re.compile(r"\bDT\s*[=:]\s*([0-9.]+(?:E[-+]?\d+)?)", re.IGNORECASE)


@dataclass(frozen=True)
class GroundMotion:
    """Ground-motion record in SI units.

    Attributes
    ----------
    name
        Name of the file, or of the synthesis.
    acceleration_m_s2
        Shape (n, components).
    interval_s
        Sampling interval [s].
    unit
        Unit in the file.
    unit_from
        Source of the unit: `given`, `header` or `peak`.
    notes
        Assumptions, for tables.
    """

    name: str
    acceleration_m_s2: FloatArray
    interval_s: float
    unit: str
    unit_from: str
    notes: tuple[str, ...] = ()

    @property
    def components(self) -> int:
        """Number of components."""
        return int(self.acceleration_m_s2.shape[1])

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample [s]."""
        return (len(self.acceleration_m_s2) - 1) * self.interval_s

    @property
    def peaks_m_s2(self) -> FloatArray:
        """Peak of each component [m/s^2]."""
        return np.asarray(np.abs(self.acceleration_m_s2).max(axis=0))

    def in_components(self, count: int) -> GroundMotion:
        """Return the record with `count` components: the first ones, and zeros for missing ones."""
        values = self.acceleration_m_s2
        if self.components >= count:
            return replace(self, acceleration_m_s2=values[:, :count])
        missing = np.zeros((len(values), count - self.components))
        note = f"{self.components} component; the others are zero"
        return replace(self, acceleration_m_s2=np.hstack([values, missing]), notes=(*self.notes, note))

    def with_second(self, other: GroundMotion) -> GroundMotion:
        """Return a record of the first components of this record and of `other`, which must have the same times."""
        if not np.isclose(self.interval_s, other.interval_s, rtol=1e-6):
            raise UserError(
                other.name,
                "DT",
                f"is {other.interval_s:g} s, the first component's {self.interval_s:g} s",
                "use one DT",
            )
        length = min(len(self.acceleration_m_s2), len(other.acceleration_m_s2))
        both = np.stack([self.acceleration_m_s2[:length, 0], other.acceleration_m_s2[:length, 0]], axis=1)
        return replace(self, name=f"{self.name} + {other.name}", acceleration_m_s2=both)

    def resampled(self, interval_s: float) -> GroundMotion:
        """Return the record at another interval, by a polyphase filter without aliases.

        The mean of the two ends is subtracted before filtering and added afterwards, so that a constant remains
        constant.
        """
        ratio = Fraction(self.interval_s / interval_s).limit_denominator(1000)
        if ratio == 1:
            return self
        start = self.acceleration_m_s2[:1]
        values = resample_poly(self.acceleration_m_s2 - start, ratio.numerator, ratio.denominator, axis=0) + start
        exact = self.interval_s * ratio.denominator / ratio.numerator
        note = f"resampled from {1.0 / self.interval_s:g} to {1.0 / exact:g} Hz"
        return replace(self, acceleration_m_s2=np.asarray(values), interval_s=exact, notes=(*self.notes, note))


@dataclass(frozen=True)
class _Raw:
    values: FloatArray  # (n, columns) without the clock
    interval_s: float | None
    header: str
    notes: tuple[str, ...] = ()


def read_motion(
    path: Path, *, unit: str | None = None, interval_s: float | None = None, fallback_interval_s: float | None = None
) -> GroundMotion:
    """Read a ground motion.

    Parameters
    ----------
    path
        `.at2`; `.mat` (a variable with rows or columns of time and acceleration); anything else is text: one column (or
        AT2-like rows), time and acceleration, two components, or time and two components.
    unit
        Unit of the samples; by default that of the header or, without one, the only unit with a plausible peak.
    interval_s
        Sampling interval [s]; it must agree with the file if the file states one.
    fallback_interval_s
        Sampling interval if neither the file nor `interval_s` gives one [s].

    Raises
    ------
    UserError
        If the file is missing or empty, contains NaN, contradicts its header (NPTS, DT), mixes units, or does not
        determine the unit.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(path, "", "no such record", "give the path of a ground-motion file")
    refuse_other_records(path)
    if path.suffix.lower() == ".at2":
        raw = _read_at2(path)
    elif path.suffix.lower() == ".mat":
        raw = _read_mat(path)
    elif path.suffix.lower() in ENDINGS:
        raw = _read_v2(path)
    elif path.suffix.lower() in _FOREIGN:
        raise UserError(path, "", f"a {path.suffix} file is not a ground-motion record", "use .at2, .txt, .csv or .mat")
    else:
        raw = _read_text(path)
    _check_finite(path, raw.values)
    interval, notes = _interval(path, raw, interval_s, fallback_interval_s)
    if not np.any(raw.values):
        raise UserError(path, "", "all samples are zero", "give a record that moves")
    found, how = _unit(path, raw, unit)
    values = to_si(raw.values, found, where=str(path), quantity="acceleration")
    _check_peaks(path, values, found)
    return GroundMotion(path.stem, values, interval, found, how, (*raw.notes, *notes))


def _text(path: Path) -> str:
    """Return the text of a file, read as Latin-1, with `^2` instead of the superscript 2."""
    return path.read_text(encoding="latin-1").replace("\u00c2\u00b2", "^2").replace("\u00b2", "^2")


def _numbers(line: str) -> list[float] | None:
    try:
        return [float(field) for field in fields_of(line)]
    except ValueError:
        return None


def _read_at2(path: Path) -> _Raw:
    record = peer_record(path, _text(path))
    return _Raw(record.samples[:, None], record.interval_s, record.header)


def _read_v2(path: Path) -> _Raw:
    """Return the first two horizontal channels of a record as it is downloaded, or of a zip of records."""
    horizontal = [item for item in read_strong_motion(path) if not item.vertical]
    if not horizontal:
        raise UserError(path, "", "holds no horizontal channel", "give a record with a horizontal channel")
    channels = horizontal[:2]
    time_s, values = common_window(path, channels)
    names = listed([item.name for item in channels])
    further = f", the first of {len(horizontal)} horizontal ones" if len(horizontal) > len(channels) else ""
    return _Raw(values, float(time_s[1] - time_s[0]), "in m/s^2", (f"channels {names}{further}",))


def _read_mat(path: Path) -> _Raw:
    try:
        content = loadmat(path)
    except Exception as error:  # scipy raises half a dozen kinds for a bad file
        raise UserError(path, "", f"not a MATLAB file that can be read ({error})", "save it as version 7") from error
    arrays = {
        key: np.asarray(value, dtype=np.float64)
        for key, value in content.items()
        if not key.startswith("__") and np.asarray(value).dtype.kind in "fiu" and np.size(value) > 2
    }
    if not arrays:
        raise UserError(path, "", "holds no array of real numbers", "store time and acceleration in one matrix")
    values = max(arrays.values(), key=np.size)
    if values.ndim > 2:
        raise UserError(path, "", f"holds an array of shape {values.shape}", "rows or columns of time and acceleration")
    values = np.atleast_2d(values)
    if values.shape[0] < values.shape[1]:
        values = values.T
    return _split_clock(path, values, "")


def _read_text(path: Path) -> _Raw:
    rows: list[list[float]] = []
    header: list[str] = []
    for number, line in enumerate(_text(path).splitlines(), start=1):
        text = line.strip()
        if not text:
            continue
        row = _numbers(text)
        if row is None:
            if rows and text[0] not in "%#":
                raise UserError(path, f"line {number}", f"is not a row of numbers ({text[:30]!r})", "correct the row")
            header.append(text)
            continue
        if rows and len(row) != len(rows[0]):
            raise UserError(
                path, f"line {number}", f"has {len(row)} columns, the first {len(rows[0])}", "correct the row"
            )
        rows.append(row)
    if not rows:
        raise UserError(path, "", "holds no samples", "one row a sample: time and acceleration, or the components")
    return _split_clock(path, np.array(rows), "\n".join(header))


def _split_clock(path: Path, values: FloatArray, header: str) -> _Raw:
    """Separate a time column: the first column, if the header names it or it is nearly monotonic."""
    points = _POINTS.search(header)
    if points and int(points.group(1)) != len(values):
        raise UserError(
            path,
            "NPTS",
            f"promises {points.group(1)} points, the file holds {len(values)}",
            "correct the header or file",
        )
    said = _INTERVAL.search(header)
    interval = float(said.group(1)) if said else None
    first = values[:, 0]
    if values.shape[1] < 2 or len(first) < 3 or not np.all(np.isfinite(first)):
        return _Raw(values, interval, header)
    steps = np.diff(first)
    named = bool(_CLOCK_NAME.match(header.splitlines()[-1])) if header else False
    if not named and 0.2 <= np.mean(steps > 0) < 0.8:
        return _Raw(values, interval, header)
    back = np.flatnonzero(steps <= 0)
    if len(back):
        row = int(back[0]) + 2
        order = f"the clock goes from {first[row - 2]:g} to {first[row - 1]:g} s"
        raise UserError(path, f"row {row}", order, "times must rise from row to row")
    bad = np.flatnonzero(~(np.abs(steps - np.median(steps)) < 0.02 * np.median(steps)))
    if len(bad):
        raise UserError(path, f"row {int(bad[0]) + 2}", "the clock is not uniform", "resample to equal intervals first")
    clock = float((first[-1] - first[0]) / (len(first) - 1))
    if interval is not None and abs(clock - interval) > 0.01 * interval:
        raise UserError(path, "DT", f"header says {interval:g} s, the clock {clock:g} s", "correct one of them")
    return _Raw(values[:, 1:], clock, header)


def _check_finite(path: Path, values: FloatArray) -> None:
    if len(values) < 10:
        raise UserError(path, "", f"holds {len(values)} samples", "a record has at least 10")
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column = int(bad[0][0]) + 1, int(bad[0][1]) + 1
        raise UserError(path, f"sample {row}, component {column}", "is not finite", "correct or leave out the sample")
    if values.shape[1] > 3:
        raise UserError(path, "", f"has {values.shape[1]} components", "one or two horizontal components are used")


def _interval(path: Path, raw: _Raw, given: float | None, fallback: float | None) -> tuple[float, tuple[str, ...]]:
    if given is not None and raw.interval_s is not None and abs(given - raw.interval_s) > 0.01 * raw.interval_s:
        raise UserError(path, "DT", f"is {raw.interval_s:g} s, but {given:g} s was given", "leave one of them out")
    found = raw.interval_s if raw.interval_s is not None else given
    notes: tuple[str, ...] = ()
    if found is None and fallback is not None:
        found, notes = fallback, (f"no interval in the file: {fallback:g} s assumed",)
    if found is None:
        raise UserError(
            path,
            "DT",
            "neither a clock nor a DT in the header",
            "give it, as --set benchmark.base_isolated.motion.interval_s=0.01 (or ten_storey)",
        )
    if not 1e-5 <= found <= 0.2:
        raise UserError(path, "DT", f"is {found:g} s", "a ground motion is sampled every 0.00001 to 0.2 s")
    return found, notes


def _unit(path: Path, raw: _Raw, given: str | None) -> tuple[str, str]:
    if given:
        return given, "given"
    if _OTHER_QUANTITY.search(raw.header):
        raise UserError(path, "header", "says that this is not an acceleration", "give the acceleration record")
    bracketed = {text.strip() for text in _UNIT_COLUMN.findall(raw.header)}
    further = {text for text in bracketed if not any(pattern.search(text) for pattern, _ in _UNITS)}
    for text in further:
        # refuse an unknown unit, or one of another quantity
        to_si(np.zeros(1), text, where=f"{path}: header", quantity="acceleration")
    said = {name for pattern, name in _UNITS if pattern.search(raw.header)} | further
    if len(said) > 1:
        raise UserError(
            path, "header", f"names the units {', '.join(sorted(said))}", f"convert all to the same unit; {_ADVICE}"
        )
    if said:
        return said.pop(), "header"
    peak = float(np.abs(raw.values).max())
    plausible = [
        name
        for name, factor in (("g", GRAVITY), ("m/s^2", 1.0), ("cm/s^2", 0.01))
        if SMALLEST_PEAK <= peak * factor <= LARGEST_PEAK
    ]
    if len(plausible) != 1:
        which = " or ".join(plausible) or "no unit that fits"
        raise UserError(path, "unit", f"not said, and the peak {peak:g} could be {which}", _ADVICE)
    return plausible[0], "peak"


def _check_peaks(path: Path, values: FloatArray, unit: str) -> None:
    peaks = np.abs(values).max(axis=0)
    if peaks.max() > IMPOSSIBLE_PEAK:
        largest = f"peak {peaks.max() / GRAVITY:.3g} g in {unit}"
        raise UserError(path, "unit", f"{largest} is not a ground motion", "the unit is wrong: g, cm/s^2 or m/s^2?")
    moving = peaks[peaks > 0.0]
    if moving.max() > 50.0 * moving.min():
        largest = ", ".join(f"{peak:.3g}" for peak in peaks)
        raise UserError(
            path, "components", f"peaks {largest} m/s² differ too much: mixed units", "use one unit for all"
        )
