"""Faults of a single channel: dead, spikes."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from mrpipe.artifacts import FloatArray, IntArray

SPIKE_NOISES = 15.0
"""A spike deviates from the median of five samples by more than this multiple of the deviation of 90 % of them."""

SPIKE_SHARE = 0.3
"""A spike deviates by more than this share of the range that 99 % of the samples cover."""


def is_dead(values: FloatArray) -> bool:
    """Return whether a channel holds one single value, apart from the rounding of numbers."""
    return bool(np.ptp(values) <= 1e-12 * max(float(np.abs(values).max()), 1e-300))


def find_spikes(values: FloatArray, share: float = SPIKE_SHARE) -> IntArray:
    """Return the indices of spikes: one or two samples far from the samples before and after them.

    `share` is the smallest deviation over the range that 99 % of the samples cover. A median of five samples preserves
    steps and corners of a signal, so only isolated samples deviate.
    """
    if values.size < 20:
        return np.zeros(0, dtype=np.int64)
    deviation = np.abs(values - median_filter(values, size=5, mode="nearest"))
    noise = float(np.quantile(deviation, 0.9)) / 1.64
    low, high = np.quantile(values, [0.005, 0.995])
    limit = max(SPIKE_NOISES * noise, share * float(high - low), 1e-12 * float(np.abs(values).max()))
    return np.asarray(np.flatnonzero(deviation > limit), dtype=np.int64)
