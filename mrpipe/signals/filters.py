"""Low-pass filters and changes of sampling rate."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Literal

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

from mrpipe.artifacts import FloatArray

Phase = Literal["zero", "causal"]

HIGHEST_SHARE_OF_NYQUIST = 0.8
"""Share of half the sampling rate above which a cut-off has no useful effect, so that the filter is omitted."""


def usable_cutoff(cutoff_hz: float, sampling_rate_hz: float) -> float | None:
    """Return the cut-off, or None if the sampling rate is so low that the filter would remove nothing."""
    return cutoff_hz if 0.0 < cutoff_hz < HIGHEST_SHARE_OF_NYQUIST * sampling_rate_hz / 2.0 else None


def samples_needed(cutoff_hz: float, sampling_rate_hz: float) -> int:
    """Return the least number of samples for a low-pass with this cut-off: three of its periods."""
    return math.ceil(3.0 * sampling_rate_hz / cutoff_hz) + 1


def butterworth_lowpass(
    values: FloatArray, cutoff_hz: float, sampling_rate_hz: float, *, order: int = 2, phase: Phase = "zero"
) -> FloatArray:
    """Low-pass `values` with a digital Butterworth filter (thesis 2.3.1).

    Parameters
    ----------
    values
        Shape (n,).
    cutoff_hz
        Frequency of half power (-3 dB), for either phase; see :func:`usable_cutoff`.
    sampling_rate_hz
        Sampling rate of the values [Hz].
    order
        Order of the filter.
    phase
        `zero` filters forwards and backwards (the design is widened so that half power stays at the cut-off); `causal`
        filters forwards only, and is late (errata D: 11 ms at 20 Hz, 2.2 ms at 100 Hz).

    Returns
    -------
    FloatArray
        Shape (n,); unchanged if the cut-off is not usable at this rate.
    """
    usable = usable_cutoff(cutoff_hz, sampling_rate_hz)
    if usable is None:
        return np.array(values, dtype=np.float64)
    if phase == "causal":
        sections = signal.butter(order, usable, fs=sampling_rate_hz, output="sos")
        start = signal.sosfilt_zi(sections) * values[0]
        return np.asarray(signal.sosfilt(sections, values, zi=start)[0])
    # two passes have half power at the design frequency times (sqrt 2 - 1)^(1/2n), on the bilinear map's own scale
    warped = math.tan(math.pi * usable / sampling_rate_hz) / (math.sqrt(2.0) - 1.0) ** (1.0 / (2.0 * order))
    design = sampling_rate_hz / math.pi * math.atan(warped)
    sections = signal.butter(order, design, fs=sampling_rate_hz, output="sos")
    padding = min(values.size - 1, math.ceil(3.0 * sampling_rate_hz / usable))
    return np.asarray(signal.sosfiltfilt(sections, values, padlen=padding))


def resample(values: FloatArray, from_hz: float, to_hz: float) -> FloatArray:
    """Return `values` at another uniform rate, without aliasing and without delay.

    A linear-phase FIR filter (polyphase, Kaiser window) removes what the lower of the two rates cannot carry. The first
    sample keeps its time. The straight line between the ends is not filtered, so that the ends do not ring.

    Parameters
    ----------
    values
        Shape (n,).
    from_hz, to_hz
        Rates; their ratio is taken as the nearest fraction with a denominator up to 2000.
    """
    ratio = Fraction(to_hz / from_hz).limit_denominator(2000)
    if ratio == 1:
        return np.array(values, dtype=np.float64)
    return np.asarray(
        signal.resample_poly(values, ratio.numerator, ratio.denominator, padtype="line", window=("kaiser", 8.0))
    )


def advance(values: FloatArray, seconds: float, sampling_rate_hz: float) -> FloatArray:
    """Return `values` at times later by `seconds` (cubic interpolation), with constant values beyond the ends."""
    if seconds == 0.0:
        return values
    place = np.arange(values.size, dtype=np.float64)
    wanted = np.clip(place + seconds * sampling_rate_hz, 0.0, values.size - 1.0)
    return np.asarray(CubicSpline(place, values)(wanted))


def even_clock(time_s: FloatArray, values: FloatArray, sampling_rate_hz: float, even_time_s: FloatArray) -> FloatArray:
    """Interpolate a channel from non-uniform times (jitter, dropouts) to uniform ones; others are unchanged."""
    if time_s.size == even_time_s.size and np.max(np.abs(time_s - even_time_s)) <= 1e-3 / sampling_rate_hz:
        return values
    return np.interp(even_time_s, time_s, values)
