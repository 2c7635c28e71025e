"""Power spectra, noise floors, and the cut-off at which a signal sinks into its noise."""

from __future__ import annotations

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray

MEDIAN_OF_FEW = 0.87
"""Median over mean of a density of three half-overlapping windows."""


def power_spectrum(values: FloatArray, sampling_rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and one-sided power density [unit^2/Hz] by Welch's method (Hann, mean removed)."""
    length = min(values.size, max(256, min(4096, values.size // 8)))
    frequencies, density = signal.welch(
        values - np.mean(values), fs=sampling_rate_hz, nperseg=length, window="hann", detrend="linear"
    )
    return np.asarray(frequencies), np.asarray(density)


def noise_floor(frequencies: FloatArray, density: FloatArray) -> float:
    """Return the power density of the noise, taken as white: the median over the upper quarter of the band.

    The last twentieth below half the sampling rate is left out, where anti-aliasing filters act.
    """
    top = frequencies[-1]
    band = (frequencies >= 0.7 * top) & (frequencies <= 0.95 * top)
    return float(np.median(density[band])) if band.any() else 0.0


def noise_level(values: FloatArray, sampling_rate_hz: float) -> float:
    """Return the standard deviation of the white noise on a channel, in its unit."""
    frequencies, density = power_spectrum(values, sampling_rate_hz)
    return float(np.sqrt(noise_floor(frequencies, density) * sampling_rate_hz / 2.0))


def cutoff_by_criterion(
    values: FloatArray,
    sampling_rate_hz: float,
    *,
    velocity_share: float | None = None,
    lowest_hz: float = 5.0,
    margin: float = 1.25,
) -> float:
    """Return the frequency above which noise outweighs the signal.

    Above it the power density, smoothed over an eighth of its frequency, stays below twice the noise floor, so what
    a low-pass there removes is noise as far as a spectrum shows. Differentiation weights signal and noise alike, so it
    is the right place for displacement, velocity and acceleration.

    Parameters
    ----------
    values
        Shape (n,).
    sampling_rate_hz
        Sampling rate [Hz].
    velocity_share
        If given, the cut-off is not higher than the frequency that holds this share of the power of the channel's
        time derivative. Under random motion the noise of a displacement sensor falls with frequency, and a cut-off at
        its white part alone would let most of it through (a recording with motions up to 250 Hz taught so).
    lowest_hz
        No cut-off below this.
    margin
        The cut-off is put this much above the frequency at which the signal reaches the noise floor.

    Returns
    -------
    float
        Cut-off [Hz], at most half the sampling rate (then no filter is needed).
    """
    frequencies, density = power_spectrum(values, sampling_rate_hz)
    floor = noise_floor(frequencies, density)
    highest = sampling_rate_hz / 2.0
    rounding = max(1e-300, float(np.max(density)) * 1e-16)
    smooth = _smooth_over_octave(frequencies, density)
    above = np.flatnonzero(smooth > 2.0 * max(floor, rounding))
    above = above[frequencies[above] <= 0.7 * highest]
    if above.size == 0:
        return lowest_hz
    knee = float(frequencies[above[-1]])
    cutoff = highest if knee >= 0.69 * highest else margin * knee
    if velocity_share is not None:
        power = np.clip(density - floor, 0.0, None) * frequencies**2
        power[frequencies > 0.7 * highest] = 0.0
        held = np.cumsum(power)
        if held[-1] > 0.0:
            cutoff = min(cutoff, margin * float(frequencies[np.searchsorted(held, velocity_share * held[-1])]))
    # a low-pass of low order takes a little off well below its cut-off, so it keeps away from the bulk of the power
    power = np.cumsum(np.clip(density - floor, 0.0, None))
    middle = float(frequencies[np.searchsorted(power, 0.5 * power[-1])])
    return float(min(highest, max(lowest_hz, 3.0 * middle, cutoff)))


def signal_end(values: FloatArray, sampling_rate_hz: float) -> float:
    """Return the frequency [Hz] up to which a motion exceeds its noise; half the rate where it does at all frequencies.

    Short windows smear a slow sine over tens of hertz, which then looks like signal. Here windows are half the record
    long and fall off by 92 dB (Blackman-Harris); a density counts only where it exceeds what so few windows scatter.

    Parameters
    ----------
    values
        Shape (n,).
    sampling_rate_hz
        Sampling rate [Hz].
    """
    length = min(values.size, max(256, values.size // 2))
    frequencies, density = signal.welch(
        values - np.mean(values), fs=sampling_rate_hz, nperseg=length, window="blackmanharris", detrend="linear"
    )
    floor = noise_floor(frequencies, density) / MEDIAN_OF_FEW
    smooth, count = averaged(frequencies, density, 0.12, 2)
    above = np.flatnonzero(smooth > (1.0 + np.maximum(1.0, 4.0 / np.sqrt(0.5 * count))) * floor)
    above = above[frequencies[above] <= 0.35 * sampling_rate_hz]
    if above.size == 0:
        return 0.0
    found = float(frequencies[above[-1]])
    return 0.5 * sampling_rate_hz if found >= 0.345 * sampling_rate_hz else found


def _smooth_over_octave(frequencies: FloatArray, density: FloatArray) -> FloatArray:
    return averaged(frequencies, density, 0.06, 1)[0]


def averaged(frequencies: FloatArray, density: FloatArray, share: float, least: int) -> tuple[FloatArray, FloatArray]:
    """Return the density averaged over a share of its frequency to either side, and over how many bins."""
    total = np.concatenate(([0.0], np.cumsum(density)))
    step = frequencies[1] - frequencies[0]
    half = np.maximum((frequencies * share / step).astype(np.int64), least)
    index = np.arange(density.size)
    low = np.maximum(index - half, 0)
    high = np.minimum(index + half + 1, density.size)
    return np.asarray((total[high] - total[low]) / (high - low)), np.asarray(high - low, dtype=np.float64)
