"""Spectra of frame tests: averaged frequency responses with coherence, and whole-record spectra for the fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.modal.records import FrameTest, Place, Sensor

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
        Shape (m, n) [1]; 1 means neither noise nor leakage.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    coherence: FloatArray


@dataclass(frozen=True)
class RecordSpectrum:
    """Spectrum of a whole record inside the band without window, because the fit models the leakage.

    Attributes
    ----------
    omega
        Shape (m,) [rad/s].
    excitations
        Shape (m, k), one column per input.
    inputs
        Floor at which each input acts; floor 0 is the ground.
    responses
        Shape (m, s), one column per sensor.
    sensors
        Place and kind of each sensor.
    dt
        Sampling interval [s].
    """

    omega: FloatArray
    excitations: ComplexArray
    inputs: tuple[Place, ...]
    responses: ComplexArray
    sensors: tuple[Sensor, ...]
    dt: float

    @property
    def excitation(self) -> ComplexArray:
        """The first input, shape (m,)."""
        return np.asarray(self.excitations[:, 0])

    def input_columns(self, inputs: Sequence[Place]) -> ComplexArray:
        """Return the spectra of `inputs`, shape (m, len(inputs)); zero if the test has no such input."""
        columns = np.zeros((self.omega.size, len(inputs)), dtype=np.complex128)
        for index, place in enumerate(inputs):
            if place in self.inputs:
                columns[:, index] = self.excitations[:, self.inputs.index(place)]
        return columns

    def below(self, omega: float) -> RecordSpectrum:
        """Return the lines up to `omega` [rad/s]."""
        inside = self.omega <= omega
        return replace(
            self, omega=self.omega[inside], excitations=self.excitations[inside], responses=self.responses[inside]
        )

    def every(self, stride: int) -> RecordSpectrum:
        """Return each `stride`-th line, because the model of the fit is valid at every line separately."""
        return replace(
            self,
            omega=self.omega[::stride],
            excitations=self.excitations[::stride],
            responses=self.responses[::stride],
        )


def thinned(spectra: Sequence[RecordSpectrum], lines: int) -> tuple[RecordSpectrum, ...]:
    """Return spectra with at most about `lines` lines in total, so that long records do not take more time."""
    stride = max(1, round(sum(item.omega.size for item in spectra) / lines))
    return tuple(item.every(stride) for item in spectra)


def averaged_responses(test: FrameTest, segment_s: float) -> FrequencyResponses:
    """Return P_gi/P_gg (3.4) and coherence by Welch's method with Hann segments that overlap by three quarters.

    Lightly damped peaks are narrower than the segment's resolution, so amplitude and coherence at a peak suffer from
    leakage; frequencies and signs do not. The multi-mode fit does not use this average.

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
    values = np.column_stack(list(test.inputs.values()))
    excitations = np.fft.rfft(values - values.mean(axis=0), axis=0)[inside]
    responses = np.fft.rfft(test.responses - test.responses.mean(axis=0), axis=0)[inside]
    return RecordSpectrum(
        omega=np.asarray(2.0 * np.pi * frequency[inside], dtype=np.float64),
        excitations=excitations,
        inputs=tuple(test.inputs),
        responses=responses,
        sensors=test.sensors,
        dt=1.0 / test.sampling_rate_hz,
    )


def excited_band(tests: tuple[FrameTest, ...], share: float = 0.03) -> tuple[float, float]:
    """Return the band [Hz] in which the excitation of all tests together has power.

    At its edges the averaged power density falls below `share` of its typical value (half of the power is at lines with
    a higher density), or below four times the noise of the sensor.
    """
    lows, highs = [], []
    for test in tests:
        if test.excitation is None:
            continue
        rate = test.sampling_rate_hz
        length = int(min(8.0, 0.25 * test.duration_s) * rate)
        frequency, power = signal.welch(test.excitation, fs=rate, nperseg=length, detrend="constant")
        # the first lines contain the drift of the sensor
        power[:2] = 0.0
        falling = np.sort(power)[::-1]
        usual = falling[int(np.searchsorted(np.cumsum(falling), 0.5 * falling.sum()))]
        floor = float(np.quantile(power[2:], 0.1))
        inside = np.flatnonzero(power >= max(share * usual, min(4.0 * floor, 0.3 * usual)))
        lows.append(float(frequency[inside[0]]))
        highs.append(float(frequency[inside[-1]]))
    return max(min(lows), 1e-3), max(highs)


def all_inputs(spectra: Sequence[RecordSpectrum]) -> tuple[Place, ...]:
    """Return the inputs of all tests; in the order of the tests."""
    return tuple(dict.fromkeys(place for item in spectra for place in item.inputs))


def all_sensors(spectra: Sequence[RecordSpectrum]) -> tuple[Sensor, ...]:
    """Return the sensors of all tests, lowest floor first."""
    return tuple(sorted(dict.fromkeys(sensor for item in spectra for sensor in item.sensors)))
