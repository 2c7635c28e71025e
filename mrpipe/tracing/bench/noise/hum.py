"""Hum of the mains in the force channel.

Cycles of a motion whose period is a multiple of that of the mains repeat the hum, so that their difference does not
show it. It is visible in the residual of a model: as a spectral line at a frequency of the mains, in nearly every test,
whatever the frequency of the motion.
"""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.shared_noise import MAINS_HZ
from mrpipe.tracing.rules import NoiseRules

HARMONICS = (1, 2, 3)
"""Numerical technique: harmonics of these frequencies that are searched."""

LEAST_CYCLES = 20.0
"""Numerical technique: least duration of a record, in periods of the mains; shorter ones are left out."""

HIGHEST_MOTION = 0.1
"""Numerical technique: highest frequency of the motion, as a share of the frequency of the line. Tests with faster
motion are left out, because its harmonics are strong there.
"""


def hum_variance(residual: FloatArray, recordings: Recordings, rules: NoiseRules) -> float:
    """Return the variance of the hum of the mains in the residual of a model [N^2]; 0 if there is none.

    Parameters
    ----------
    residual
        Measured minus simulated force [N], shape (n,); zero at samples that are not compared.
    recordings
        Tests of the residual.
    rules
        Decision thresholds.
    """
    return max(sum(_line(residual, recordings, factor * mains, rules) for factor in HARMONICS) for mains in MAINS_HZ)


def _line(residual: FloatArray, recordings: Recordings, frequency_hz: float, rules: NoiseRules) -> float:
    """Return the variance of a spectral line that nearly all tests share [N^2]; 0 if there is none."""
    excess = []
    for test in range(recordings.tests):
        used = np.flatnonzero(recordings.used & (recordings.test == test))
        dt, motion_hz = float(recordings.dt[test]), 1.0 / float(recordings.motion_period_s[test])
        if len(used) * dt * frequency_hz < LEAST_CYCLES or frequency_hz * dt >= 0.5:
            continue
        if motion_hz > HIGHEST_MOTION * frequency_hz:
            continue
        time, values = np.asarray(dt * used), np.asarray(residual[used] - np.mean(residual[used]))
        width = 1.0 / (len(used) * dt)
        # harmonics of the motion, and frequencies beyond the main lobe of the window
        apart = np.concatenate([width * np.arange(3.0, 9.0), motion_hz * np.array([1.0, 2.0])])
        around = np.concatenate([frequency_hz - apart, frequency_hz + apart])
        around = around[(around > 0.0) & (around * dt < 0.5)]
        power = _powers(time, np.asarray(values), np.concatenate([[frequency_hz], around]))
        harmonics = power[1:][np.isin(np.round(np.abs(around - frequency_hz), 9), np.round(apart[-2:], 9))]
        level = max(float(np.mean(power[1:])), float(np.mean(harmonics)) if len(harmonics) else 0.0)
        excess.append(power[0] - level if power[0] > rules.hum_line * level else 0.0)
    least = rules.hum_tests * recordings.tests
    if len(excess) < max(2.0, least) or np.count_nonzero(excess) < rules.hum_tests * len(excess):
        return 0.0
    return float(np.median(excess))


def _powers(time: FloatArray, values: FloatArray, frequencies_hz: FloatArray) -> FloatArray:
    """Return the mean square of the sine at each frequency, shape of the frequencies; Hann window."""
    window = np.hanning(len(values))
    waves = np.exp(-2j * np.pi * np.outer(frequencies_hz, time))
    amplitude = 2.0 * np.abs(waves @ (window * values)) / float(np.sum(window))
    return np.asarray(0.5 * amplitude**2, dtype=np.float64)
