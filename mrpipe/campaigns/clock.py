"""The clock of a test: its source, and checks of its samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.campaigns.columns import DataFile
from mrpipe.errors import UserError
from mrpipe.words import counted, in_percent

RATE_TOLERANCE = 0.01
"""Largest relative difference between a stated rate and the clock."""

JITTER_TOLERANCE = 0.02
"""Largest rms deviation of an interval from the median, over the median, without a finding."""

MOST_REPEATED_TIMES = 0.05
"""Largest share of samples with the time of the sample before; above it the clock was printed with too few digits."""

SHORTEST_GAP = 3
"""Number of lost samples from which a record counts as interrupted; fewer disturb it less than noise does."""


@dataclass(frozen=True)
class Clock:
    """Time of each sample [s], shape (n,), nominal rate [Hz], and findings."""

    time_s: FloatArray
    sampling_rate_hz: float
    findings: tuple[str, ...] = ()


def build_clock(
    file: DataFile, time: FloatArray | None, stated_rate_hz: float | None, samples: int, where: str
) -> Clock:
    """Return the clock of a test from its time channel, the file's own clock, or the stated rate.

    Parameters
    ----------
    file
        Data file, for messages.
    time
        Time channel [s], shape (n,), or None.
    stated_rate_hz
        Rate of campaign.yaml, or None.
    samples
        Number of samples n.
    where
        Names the test in messages.

    Raises
    ------
    UserError
        If the clock stands still or runs backwards, holds NaN, disagrees with the stated rate, or is not given.
    """
    if time is None:
        time = file.time_s
    if time is None:
        rate = stated_rate_hz or file.sampling_rate_hz
        if rate is None:
            raise UserError(file.path, where, "no clock", "name a time channel in channels: or give sampling_rate_hz:")
        return Clock(np.arange(samples) / rate, rate)
    if time.size != samples:
        raise UserError(
            file.path,
            where,
            f"time has {time.size} samples, the channels {samples}",
            "choose columns of the same length",
        )
    _require_increasing(file, time, where)
    rate = _measured_rate(file, time)
    if stated_rate_hz is not None:
        if abs(rate / stated_rate_hz - 1.0) > RATE_TOLERANCE:
            raise UserError(
                file.path,
                where,
                f"the clock runs at {rate:.6g} Hz, but sampling_rate_hz says {stated_rate_hz:.6g}",
                "correct sampling_rate_hz or the unit of time",
            )
        rate = stated_rate_hz
    time = _unrounded(time)
    return Clock(time, rate, _irregularities(time, rate, file.parts))


def _require_increasing(file: DataFile, time: FloatArray, where: str) -> None:
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise UserError(
            file.path,
            f"{where}, row {file.line_of(int(bad[0]))}",
            f"time is {time[bad[0]]}",
            "every sample needs its time",
        )
    steps = np.diff(time)
    wrong = np.flatnonzero(~(steps > 0.0))
    if wrong.size:
        index = int(wrong[0]) + 1
        place = f"{where}, row {file.line_of(index)}"
        if wrong.size > MOST_REPEATED_TIMES * steps.size and not np.any(steps < 0.0):
            problem = f"{wrong.size} of {time.size} samples have the same time as the one before, the first at "
            remedy = "export the time with more digits, or leave the time channel out and give sampling_rate_hz"
            raise UserError(file.path, place, f"{problem}{time[index]:.9g} s", remedy)
        raise UserError(
            file.path,
            place,
            f"time goes from {time[index - 1]:.9g} to {time[index]:.9g} s",
            "a clock that increases with every sample expected",
        )


def _measured_rate(file: DataFile, time: FloatArray) -> float:
    """Return the rate of the mean interval without the gaps, rounded where the clock's digits do not carry more."""
    if file.sampling_rate_hz is not None and file.time_s is time:
        return float(file.sampling_rate_hz)
    steps = np.diff(time)
    lost = lost_samples(time, 1.0 / float(np.median(steps)))
    gaps = np.flatnonzero(lost)
    regular = np.ones(steps.size, dtype=bool)
    regular[gaps] = False
    rate = 1.0 / float(np.mean(steps[regular]))
    rounded = float(f"{rate:.4g}")
    return rounded if abs(rounded / rate - 1.0) < 2e-5 else rate


def lost_samples(time: FloatArray, rate: float) -> IntArray:
    """Return how many samples are missing after each sample, shape (n - 1,).

    A jittering clock also has long intervals, but short ones next to them make up for it. After lost samples the
    clock stays late, so the medians of a few samples before and after an interval are compared.
    """
    steps = np.diff(time) * rate
    lost = np.zeros(steps.size, dtype=np.int64)
    for gap in np.flatnonzero(steps > 1.5):
        first, last = max(0, int(gap) - 14), min(time.size, int(gap) + 16)
        late_by = time[first:last] * rate - np.arange(first, last)
        late = np.median(late_by[gap + 1 - first :]) - np.median(late_by[: gap + 1 - first])
        lost[gap] = max(0, round(float(late) - 0.1))
    return lost


def unbroken_parts(
    time_s: FloatArray, rate_hz: float, segments: Sequence[tuple[int, int]] = ()
) -> list[tuple[int, int]]:
    """Return begin and end of each part of a test without a gap, in the order of time.

    Parameters
    ----------
    time_s, rate_hz
        Clock of the test, shape (n,), and its nominal rate.
    segments
        Half-open index ranges that are used; empty: all samples.
    """
    parts: list[tuple[int, int]] = []
    for begin, end in segments or ((0, time_s.size),):
        lost = lost_samples(time_s[begin:end], rate_hz)
        gaps = begin + 1 + np.flatnonzero(lost >= SHORTEST_GAP)
        parts += pairwise([begin, *(int(gap) for gap in gaps), end])
    return parts


def longest_part(time_s: FloatArray, rate_hz: float, segments: Sequence[tuple[int, int]] = ()) -> tuple[int, int, bool]:
    """Return begin and end of the longest part of a test without a gap, and whether there was a gap.

    The parameters are those of :func:`unbroken_parts`.
    """
    parts = unbroken_parts(time_s, rate_hz, segments)
    begin, end = max(parts, key=lambda item: item[1] - item[0])
    return begin, end, len(parts) > max(1, len(segments))


def _unrounded(time: FloatArray) -> FloatArray:
    """Return an even clock where the given one deviates from it only by the rounding of its printed digits."""
    # with a fixed number of significant digits, the end of the record is the coarsest
    late = time[time.size // 2 :]
    digits = next((count for count in range(10) if np.allclose(late, np.round(late, count), rtol=0, atol=1e-11)), 12)
    index = np.arange(time.size)
    slope, start = np.polyfit(index, time, 1)
    even = np.asarray(round(float(start), 12) + slope * index)
    return even if float(np.max(np.abs(time - even))) <= 0.75 * 10.0**-digits else time


def _irregularities(time: FloatArray, rate: float, parts: tuple[tuple[int, int], ...]) -> tuple[str, ...]:
    findings = []
    steps = np.diff(time) * rate
    pauses = np.zeros(steps.size, dtype=bool)
    pauses[[start - 1 for start, _ in parts if start > 0]] = True
    lost = np.where(pauses, 0, lost_samples(time, rate))
    gaps = np.flatnonzero(lost)
    if gaps.size:
        findings.append(
            f"{counted(gaps.size, 'gap')} in the clock, {int(lost.sum())} samples are missing; the first gap is at "
            f"{time[gaps[0]]:.4g} s, the longest lasts {steps[gaps].max() / rate:.3g} s"
        )
    regular = steps[(lost == 0) & ~pauses]
    if regular.size:
        jitter = float(np.sqrt(np.mean((regular - np.median(regular)) ** 2)))
        if jitter > JITTER_TOLERANCE:
            findings.append(f"clock jitter of {in_percent(jitter, digits=2)} of the sampling interval (RMS)")
    return tuple(findings)
