"""Steady cycles, detected in the displacement."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray

PERIOD_TOLERANCE = 0.05
AMPLITUDE_TOLERANCE = 0.05
DRIFT_TOLERANCE = 0.2
"""Largest difference between the middles of two consecutive steady cycles, as a share of their amplitude. The middle of
a machine without position control drifts by up to a tenth from cycle to cycle.
"""

STEADY_SHARE = 0.33
SHARE_OF_A_PAIR = 0.6
SINE_TOLERANCE = 0.03


@dataclass(frozen=True)
class SteadyCycles:
    """Steady part of a test.

    Attributes
    ----------
    starts
        Index of the first sample at or above the mean level in each steady cycle, and of the end of the last one,
        shape (cycles + 1,); empty where the motion is not periodic.
    frequency_hz
        Frequency of the steady cycles; 0 if there are none.
    amplitude
        Half of peak to peak, in the unit of the displacement.
    """

    starts: IntArray
    frequency_hz: float = 0.0
    amplitude: float = 0.0

    @property
    def periodic(self) -> bool:
        """Whether steady cycles were found."""
        return self.starts.size > 1

    @property
    def span(self) -> slice:
        """Samples from the first steady cycle to the end of the last one; all samples if there are none."""
        return slice(int(self.starts[0]), int(self.starts[-1])) if self.periodic else slice(None)


def upward_crossings(values: FloatArray, level: float, hysteresis: float) -> IntArray:
    """Return the first sample at or above `level` after each time that `values` was below `level - hysteresis`.

    A crossing is valid when `values` reaches `level + hysteresis`, so that noise near the level causes no crossings.
    """
    high = values >= level + hysteresis
    low = values < level - hysteresis
    marks = np.flatnonzero(high | low)
    if marks.size < 2:
        return np.zeros(0, dtype=np.int64)
    rises = np.flatnonzero(low[marks[:-1]] & high[marks[1:]])
    crossings = np.zeros(rises.size, dtype=np.int64)
    for count, rise in enumerate(rises):
        begin, end = int(marks[rise]), int(marks[rise + 1])
        below = np.flatnonzero(values[begin:end] < level)
        crossings[count] = begin + (int(below[-1]) if below.size else 0) + 1
    return crossings


def find_steady_cycles(displacement: FloatArray, sampling_rate_hz: float, *, fewest: int = 2) -> SteadyCycles:
    """Return the longest run of cycles that agree in period and amplitude within 5 %, at least a third of the motion.

    Parameters
    ----------
    displacement
        Shape (n,), low-passed; an offset does not matter.
    sampling_rate_hz
        Rate.
    fewest
        Smallest number of cycles of a periodic motion. Two cycles are sufficient only if they are most of the motion.
    """
    none = SteadyCycles(np.zeros(0, dtype=np.int64))
    low, high = np.percentile(displacement, [2.0, 98.0])
    level, half = 0.5 * (low + high), 0.5 * (high - low)
    if not half > 0.0:
        return none
    crossings = upward_crossings(displacement, float(level), 0.3 * float(half))
    if crossings.size < fewest + 1:
        return none
    periods = np.diff(crossings).astype(np.float64)
    tops, bottoms = (
        np.array([extreme(displacement[begin:end]) for begin, end in pairwise(crossings)])
        for extreme in (np.max, np.min)
    )
    heights = 0.5 * (tops - bottoms)
    begin, end = _longest_steady_run(periods, heights, 0.5 * (tops + bottoms))
    # a slow sweep and a random motion have steady parts as well, but these are not periodic tests
    share = SHARE_OF_A_PAIR if end - begin == 2 else STEADY_SHARE
    if end - begin < fewest or np.sum(periods[begin:end]) < share * np.sum(periods):
        return none
    starts = crossings[begin : end + 1].astype(np.int64)
    span = float(starts[-1] - starts[0])
    return SteadyCycles(starts, (end - begin) * sampling_rate_hz / span, float(np.median(heights[begin:end])))


def _longest_steady_run(periods: FloatArray, heights: FloatArray, levels: FloatArray) -> tuple[int, int]:
    """Return the half-open range of the longest run whose cycles lie within the tolerances of one of them.

    The middle of a cycle is compared with that of the cycle before, because it may drift.
    """
    best = (0, 0)
    # one sample of period is always allowed: fast tests have few samples a cycle
    allowed = np.maximum(PERIOD_TOLERANCE * periods, 1.0)
    for seed in range(periods.size):
        if best[0] <= seed < best[1]:
            continue
        good = (np.abs(periods - periods[seed]) <= allowed) & (
            np.abs(heights - heights[seed]) <= AMPLITUDE_TOLERANCE * heights[seed]
        )
        joined = np.abs(np.diff(levels)) <= DRIFT_TOLERANCE * heights[seed]
        begin = seed
        while begin > 0 and good[begin - 1] and joined[begin - 1]:
            begin -= 1
        end = seed
        while end < periods.size and good[end] and (end == seed or joined[end - 1]):
            end += 1
        if end - begin > best[1] - best[0]:
            best = (begin, end)
    return best


def is_sine(displacement: FloatArray, cycles: SteadyCycles) -> bool:
    """Return whether the steady motion is a sine: its harmonics reach at most 3 % of it (a triangle's 12 %).

    Parameters
    ----------
    displacement
        Shape (n,), low-passed.
    cycles
        Steady cycles of it.
    """
    if not cycles.periodic:
        return False
    values = displacement[cycles.span]
    phase = 2.0 * np.pi * (cycles.starts.size - 1) * np.arange(values.size) / values.size
    basis = np.column_stack([np.ones_like(phase), phase, np.sin(phase), np.cos(phase)])
    rest = values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(np.std(rest)) <= SINE_TOLERANCE * float(np.std(values))


def choose_cycles(cycles: SteadyCycles, count: int, settle: int) -> IntArray:
    """Return the starts of `count` cycles (0: all) after leaving out `settle` cycles at the beginning.

    Three cycles remain in any case, so that a short test loses fewer at its beginning.
    """
    starts = cycles.starts
    if starts.size < 2:
        return starts
    available = starts.size - 1
    skip = min(settle, max(0, available - 3))
    remaining = available - skip
    return starts[skip : skip + (remaining if count == 0 else min(count, remaining)) + 1]
