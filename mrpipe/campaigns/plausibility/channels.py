"""Faults of a single channel: dead, stuck for a while, spikes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from mrpipe.artifacts import FloatArray, IntArray

CHANCE = 1e-9
"""Largest expected number of runs of equal samples that may occur by chance before a channel is called stuck."""

SPIKE_NOISES = 15.0
"""A spike deviates from the median of five samples by more than this multiple of the deviation of 90 % of them."""

SPIKE_SHARE = 0.3
"""A spike deviates by more than this share of the range that 99 % of the samples cover."""


@dataclass(frozen=True)
class Stuck:
    """A stretch of equal samples: first index, number of samples, and how many such stretches there are."""

    first: int
    samples: int
    count: int


def is_dead(values: FloatArray) -> bool:
    """Return whether a channel holds one single value but for the rounding of numbers."""
    return bool(np.ptp(values) <= 1e-12 * max(float(np.abs(values).max()), 1e-300))


def find_stuck(values: FloatArray, company: FloatArray) -> Stuck | None:
    """Return the longest stretch in which a channel repeats one value while another channel keeps moving.

    The number of equal neighbours outside the stretch gives the probability of a repeated sample; a stretch counts
    where chance would produce fewer than :data:`CHANCE` of its length. A turning point of a coarsely resolved motion
    dwells for a while too, so a stretch must end in a jump beyond the channel's usual steps, or be much longer than
    nearly all other stretches.

    Parameters
    ----------
    values
        The channel, shape (n,).
    company
        Another channel of the same test, shape (n,): where it rests as well, the rig was at rest.
    """
    steps = np.abs(np.diff(values))
    if steps.size < 50 or not steps.any():
        return None
    edges = np.diff(np.concatenate(([0], (steps == 0.0).astype(np.int8), [0])))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    inside = (begins > 0) & (ends < steps.size)
    begins, ends = begins[inside], ends[inside]
    lengths = ends - begins
    if lengths.size == 0 or lengths.max() < 10:
        return None
    typical = float(np.median(lengths)) if lengths.size > 4 else 1.0
    moving = steps[steps > 0.0]
    usual_step = float(np.quantile(moving, 0.99))
    pace = float(np.median(np.abs(np.diff(company))))
    found = []
    for begin, end, length in zip(begins, ends, lengths, strict=True):
        if length < 10:
            continue
        repeats = (int(np.count_nonzero(steps == 0.0)) - length) / max(steps.size - length, 1)
        by_chance = steps.size * max(repeats, 1e-6) ** float(length)
        jump = max(float(steps[begin - 1]), float(steps[end]))
        unusual = jump > 2.0 * usual_step or length > 20.0 * max(typical, 1.0)
        still_company = np.median(np.abs(np.diff(company[begin : end + 1]))) < 0.1 * pace
        if by_chance < CHANCE and unusual and not still_company:
            found.append((int(begin), int(length) + 1))
    if not found:
        return None
    first, samples = max(found, key=lambda item: item[1])
    return Stuck(first, samples, len(found))


def find_spikes(values: FloatArray, share: float = SPIKE_SHARE) -> IntArray:
    """Return the indices of spikes: one or two samples far from the samples before and after them.

    `share` is the smallest deviation over the range that 99 % of the samples cover. Steps and corners of a signal stay
    where they are under a median of five samples, so only isolated samples deviate.
    """
    if values.size < 20:
        return np.zeros(0, dtype=np.int64)
    deviation = np.abs(values - median_filter(values, size=5, mode="nearest"))
    noise = float(np.quantile(deviation, 0.9)) / 1.64
    low, high = np.quantile(values, [0.005, 0.995])
    limit = max(SPIKE_NOISES * noise, share * float(high - low), 1e-12 * float(np.abs(values).max()))
    return np.asarray(np.flatnonzero(deviation > limit), dtype=np.int64)
