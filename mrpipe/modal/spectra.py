"""Spectra of frame tests: averaged frequency responses with coherence, and whole-record spectra for the fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.modal.records import FrameTest

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class FrequencyResponses:
    """Averaged frequency responses (3.4).

    Attributes
    ----------
    frequency_hz
        Shape (m,).
    response
        Shape (m, n): output over excitation.
    coherence
        Shape (m, n) [1]; 1 is no noise and no leakage.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    coherence: FloatArray


@dataclass(frozen=True)
class RecordSpectrum:
    """Spectrum of a whole record inside the band, without window: leakage is modelled, not tapered.

    Attributes
    ----------
    omega
        Shape (m,) [rad/s].
    excitation
        Shape (m,).
    responses
        Shape (m, n).
    is_displacement
        Shape (n,).
    shaker_floor
        0 for excitation by the base.
    dt
        Sampling interval [s].
    """

    omega: FloatArray
    excitation: ComplexArray
    responses: ComplexArray
    is_displacement: tuple[bool, ...]
    shaker_floor: int
    dt: float


def averaged_responses(test: FrameTest, segment_s: float) -> FrequencyResponses:
    """Return P_gi/P_gg (3.4) and coherence by Welch's method with Hann segments that overlap by three quarters.

    Lightly damped peaks are narrower than the segment's resolution, so amplitude and coherence at a peak suffer from
    leakage; frequencies and signs do not. The multi-mode fit takes no such average.

    Parameters
    ----------
    test
        A forced test.
    segment_s
        Length of a segment [s]; at most a quarter of the record is used.
    """
    if test.excitation is None:
        raise ValueError("a frequency response needs the excitation")
    rate = test.sampling_rate_hz
    length = int(min(segment_s, 0.25 * test.duration_s) * rate)
    options = {"fs": rate, "nperseg": length, "noverlap": (3 * length) // 4, "detrend": "constant"}
    frequency, cross = signal.csd(test.excitation[:, None], test.responses, axis=0, **options)
    auto = signal.welch(test.excitation, **options)[1]
    power = signal.welch(test.responses, axis=0, **options)[1]
    tiny = np.finfo(float).tiny
    coherence = np.abs(cross) ** 2 / np.maximum(auto[:, None] * power, tiny)
    return FrequencyResponses(frequency, cross / np.maximum(auto[:, None], tiny), coherence)


def record_spectrum(test: FrameTest, band_hz: tuple[float, float]) -> RecordSpectrum:
    """Return the discrete Fourier transform of a whole test inside a band."""
    if test.excitation is None:
        raise ValueError("a spectrum for the fit needs the excitation")
    samples = test.responses.shape[0]
    frequency = np.fft.rfftfreq(samples, 1.0 / test.sampling_rate_hz)
    frequency = np.asarray(frequency, dtype=np.float64)
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1]) & (frequency > 0.0)
    excitation = np.fft.rfft(test.excitation - test.excitation.mean())[inside]
    responses = np.fft.rfft(test.responses - test.responses.mean(axis=0), axis=0)[inside]
    return RecordSpectrum(
        omega=np.asarray(2.0 * np.pi * frequency[inside], dtype=np.float64),
        excitation=excitation,
        responses=responses,
        is_displacement=test.is_displacement,
        shaker_floor=test.shaker_floor,
        dt=1.0 / test.sampling_rate_hz,
    )


def excited_band(tests: tuple[FrameTest, ...], share: float = 0.01) -> tuple[float, float]:
    """Return the band [Hz] in which the excitation of all tests together has power.

    The edges are where the smoothed power density falls below `share` of its median over the stretch that holds 98 %
    of the excitation's power.
    """
    lows, highs = [], []
    for test in tests:
        if test.excitation is None:
            continue
        rate = test.sampling_rate_hz
        length = int(min(16.0, 0.25 * test.duration_s) * rate)
        frequency, power = signal.welch(test.excitation, fs=rate, nperseg=length, detrend="constant")
        # the power below the first lines is drift of the sensor
        power[:1] = 0.0
        total = np.cumsum(power) / np.sum(power)
        core = (total >= 0.01) & (total <= 0.99)
        level = share * np.median(power[core])
        above = np.flatnonzero(power >= level)
        lows.append(float(frequency[above[0]]))
        centre = int(np.flatnonzero(core)[-1])
        beyond = np.flatnonzero(power[centre:] < level)
        highs.append(float(frequency[centre + beyond[0]] if beyond.size else frequency[-1]))
    return max(min(lows), 1e-3), max(highs)
