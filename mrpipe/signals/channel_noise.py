"""Noise, quantisation step and useful band of a recorded channel, estimated from this channel only."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.signals.spectra import cutoff_by_criterion, noise_level, signal_end

CUTOFF_MARGIN = 1.5
"""The displacement is cut off at this multiple of the frequency above which it is below its noise."""

QUANTISED_SHARE = 0.5
"""A channel with fewer different values than this share of its samples is quantised."""

FLOATING_POINT = 1e-9
"""Numerical technique: values closer than this share of their range are equal."""

OFF_STEP = 0.01
"""Numerical technique: a value at most this share of a step from a whole multiple of it is on the multiple."""

DISPLACEMENT_HARMONICS = 8.0
"""Least cut-off of a displacement, in multiples of the frequency of the motion."""


def steady_noise(values: FloatArray, rate_hz: float) -> float:
    """Return the standard deviation of the noise of a channel, in its unit.

    Corners of a force at reversals, and jumps of a channel that was stuck for a while, reach up to the highest
    frequencies and look like noise in a spectrum. They are few, so that they do not affect the median of third
    differences.
    """
    spectral = noise_level(values, rate_hz)
    typical = float(np.median(np.abs(np.diff(values, 3)))) / (0.6745 * np.sqrt(20.0))
    return float(max(min(spectral, max(typical, 0.2 * spectral)), resolution(values) / np.sqrt(12.0)))


def resolution(values: FloatArray) -> float:
    """Return the step of a quantised channel, in its unit; 0 if it is not quantised.

    Rounding to steps of q adds noise of q / sqrt(12) (Widrow and Kollar, Quantization Noise, 2008). A converter with
    fine steps gives nearly as many values as samples, but all of them are whole multiples of the step from each other.
    """
    levels = np.unique(values)
    if len(levels) < 3:
        return 0.0
    steps = np.diff(levels)
    # a change of the unit separates equal values by an error of floating point
    steps = steps[steps > FLOATING_POINT * np.ptp(levels)]
    step = float(np.ptp(levels) / np.rint(np.ptp(levels) / np.min(steps)))
    multiples = (levels - levels[0]) / step
    if np.max(np.abs(multiples - np.rint(multiples))) < OFF_STEP:
        return step
    return float(np.median(steps)) if len(levels) <= QUANTISED_SHARE * len(values) else 0.0


def displacement_cutoff(displacement: FloatArray, rate_hz: float, motion_hz: float) -> float:
    """Return the frequency [Hz] above which a displacement is below its noise, at most a quarter of the rate.

    Parameters
    ----------
    displacement
        Shape (n,) [m], unfiltered.
    rate_hz
        Sampling rate.
    motion_hz
        Frequency of the motion; 0 without motion.
    """
    found = cutoff_by_criterion(displacement, rate_hz, velocity_share=0.9995, margin=CUTOFF_MARGIN)
    # remaining noise is differentiated twice if an effect needs the acceleration
    found = min(found, CUTOFF_MARGIN * signal_end(displacement, rate_hz))
    # a channel without motion has no frequency and needs no filter
    least = DISPLACEMENT_HARMONICS * motion_hz or 0.25 * rate_hz
    return float(min(max(found, least), 0.25 * rate_hz, 250.0))


def motion_frequency(displacement: FloatArray, velocity: FloatArray) -> float:
    """Return the ratio of RMS velocity to RMS displacement over 2 pi as frequency [Hz]; 0 without motion."""
    motion = float(np.std(displacement))
    return float(np.std(velocity)) / (2.0 * np.pi * motion) if motion > 0.0 else 0.0
