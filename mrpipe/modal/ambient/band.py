"""Frequency band of ambient responses that contains modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import signal

from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import ComplexArray

USABLE_BAND = 0.45
"""Share of the sampling rate below which an anti-alias filter does not change the responses."""
_SEGMENT_PERIODS = 40.0
_LEAST_COMMON = 0.25
_MARGIN = 1.15


def lowest_peak_hz(tests: Sequence[FrameTest], low_hz: float) -> float:
    """Return the frequency of the lowest peak of the responses [Hz]."""
    test = tests[0]
    length = int(min(test.responses.shape[0], max(256, 40.0 / low_hz * test.sampling_rate_hz)))
    frequency, power = signal.welch(test.responses, fs=test.sampling_rate_hz, nperseg=length, axis=0)
    total = np.sum(power / power.sum(axis=0), axis=1)
    total[frequency < low_hz] = 0.0
    peaks = signal.find_peaks(total, height=0.05 * total.max())[0]
    return float(frequency[peaks[0] if peaks.size else int(np.argmax(total))])


def coherency(segments: ComplexArray) -> ComplexArray:
    """Return the complex coherency of sensors at each frequency, shape (m, s, s), of spectra of shape (m, s, t).

    It is the cross-spectrum, averaged over t segments, over the root of the two power spectra; its diagonal is one.
    """
    cross = np.einsum("fit,fjt->fij", segments, segments.conj())
    size = np.sqrt(np.maximum(np.real(np.einsum("fii->fi", cross)), 1e-300))
    return np.asarray(cross / (size[:, :, None] * size[:, None, :]))


def common_motion_ends_hz(test: FrameTest, first_hz: float) -> float:
    """Return the frequency [Hz] above which the motions of the sensors are not coherent.

    At a resonance all sensors move together, so that the largest eigenvalue of their coherence matrix is near the
    number of sensors; noise of the sensors and local forces leave it near 1.
    """
    rate, (samples, sensors) = test.sampling_rate_hz, test.responses.shape
    length = int(min(samples / 16, _SEGMENT_PERIODS / first_hz * rate))
    values = test.responses - test.responses.mean(axis=0)
    frequency, _, segments = signal.stft(values, fs=rate, nperseg=max(length, 16), axis=0, boundary=None)
    largest = np.linalg.eigvalsh(coherency(segments))[:, -1]
    common = np.flatnonzero(largest >= 1.0 + _LEAST_COMMON * (sensors - 1))
    return _MARGIN * max(float(frequency[common[-1]]) if common.size else 0.0, 2.0 * first_hz)
