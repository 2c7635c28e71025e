"""Harmonics of machines in ambient records: lines of constant amplitude and phase.

A machine that runs at one frequency is a deterministic line in the responses. Near a mode it would be taken for the
mode, with very small damping. A mode under random forces looks similar, but its amplitude and phase change with the
correlation time 1/(zeta omega). The record is therefore divided into M segments. The complex amplitude z_m of a line is
the same in all of them. That of a mode is a complex Gaussian sequence with a known correlation. The share of the mean
in the power of the segments,

    R = |sum z_m|^2 / (M sum |z_m|^2),

is above r where the quadratic form z'(J/M - r I)z is positive (J: all elements one). It has one positive eigenvalue l_1
and M - 1 negative ones, so that this happens with the probability prod 1/(1 + |l_i|/l_1). It is largest for the largest
correlation, which is that of the least damping ratio that a structure can have. Where a record is too short to
distinguish a line from such a mode, the line remains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from scipy import optimize, signal

from mrpipe.artifacts import FloatArray
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import ComplexArray

_LEAST_STRUCTURAL_DAMPING = 1e-3
"""Damping ratio below that of every structure: the most line-like mode that is not taken for a harmonic."""
_LEVEL = 1e-3
"""Probability that any line is found in a record that has none."""
_MOST_SEGMENTS = 64
_LEAST_SEGMENTS = 4
_MEDIAN_LINES = 60
_LINE_WIDTH = 3
"""Half width of the main lobe of the window, in lines of the spectrum, with a margin."""
_MOST_CANDIDATES = 40
_ROUNDS = 5
_QUADRATURE = 64
"""Points of the integrals over a segment."""


@dataclass(frozen=True)
class Harmonic:
    """A line that was removed from a test: its frequency [Hz], and its largest amplitude over the sensors."""

    test: str
    frequency_hz: float
    amplitude: float


def without_harmonics(tests: Sequence[FrameTest], low_hz: float) -> tuple[tuple[FrameTest, ...], tuple[Harmonic, ...]]:
    """Return ambient tests without the lines of machines, and these lines.

    Parameters
    ----------
    tests
        Ambient tests.
    low_hz
        Lower end of the band in which lines are searched [Hz].
    """
    cleaned = [_cleaned(test, low_hz) for test in tests]
    return tuple(test for test, _ in cleaned), tuple(line for _, lines in cleaned for line in lines)


def harmonic_findings(harmonics: Sequence[Harmonic]) -> list[str]:
    """Return one sentence for each test that names its lines."""
    findings = []
    for name, own in groupby(harmonics, key=lambda item: item.test):
        lines = [f"{value:.5g}" for value in sorted(item.frequency_hz for item in own)]
        what = f"a harmonic of {lines[0]} Hz" if len(lines) == 1 else f"harmonics of {', '.join(lines)} Hz"
        were = "was" if len(lines) == 1 else "were"
        findings.append(
            f"test {name}: {what}, probably of a machine or of the mains, {were} removed, because amplitude and phase "
            "do not change over the record"
        )
    return findings


def _cleaned(test: FrameTest, low_hz: float) -> tuple[FrameTest, list[Harmonic]]:
    """Return a test without its lines. Each round searches what the stronger lines of the rounds before had hidden."""
    values = test.responses - test.responses.mean(axis=0)
    found: list[float] = []
    rest = values
    for _ in range(_ROUNDS):
        new = _lines(rest, test.sampling_rate_hz, low_hz)
        new = [item for item in new if all(abs(item - known) * test.duration_s > _LINE_WIDTH for known in found)]
        if not new:
            break
        found += new
        basis = _waves(found, values.shape[0], test.sampling_rate_hz)
        rest = values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
    if not found:
        return test, []
    removed = values - rest
    lines = []
    for frequency in found:
        basis = _waves([frequency], values.shape[0], test.sampling_rate_hz)
        size = np.hypot(*np.linalg.lstsq(basis, removed, rcond=None)[0])
        lines.append(Harmonic(test.name, frequency, float(size.max())))
    return replace(test, responses=test.responses - removed), lines


def _waves(frequencies_hz: Sequence[float], samples: int, rate: float) -> FloatArray:
    phase = 2.0 * np.pi * np.outer(np.arange(samples) / rate, np.asarray(frequencies_hz))
    return np.hstack([np.cos(phase), np.sin(phase)])


def _lines(values: FloatArray, rate: float, low_hz: float) -> list[float]:
    """Return the frequencies of lines of constant amplitude and phase [Hz] in responses of shape (m, s)."""
    samples, sensors = values.shape
    spectrum = np.abs(np.fft.rfft(values * np.hanning(samples)[:, None], axis=0)) ** 2
    frequency = np.fft.rfftfreq(samples, 1.0 / rate)
    ratio = np.max(spectrum / np.maximum(_local(spectrum), 1e-300), axis=1)
    ratio[(frequency < low_hz) | (frequency > 0.49 * rate)] = 0.0
    # a line of the spectrum exceeds this where there is no harmonic with a probability of one in a hundred
    height = np.log(100.0 * ratio.size * sensors)
    peaks = signal.find_peaks(ratio, height=height, distance=_LINE_WIDTH)[0]
    peaks = sorted(peaks[np.argsort(-ratio[peaks])][:_MOST_CANDIDATES].tolist())
    refined = [_refined(values, rate, float(frequency[peak])) for peak in peaks]
    return [item for item in refined if _is_constant(values, rate, item, len(refined))]


def _local(spectrum: FloatArray) -> FloatArray:
    """Return the mean of the neighbours of each line, shape (m, s), from the median of parts of the spectrum.

    A line of constant amplitude does not change the median. That of an exponential distribution is ln 2 of the mean.
    """
    parts = np.array_split(np.arange(spectrum.shape[0]), max(2, spectrum.shape[0] // _MEDIAN_LINES))
    middle = [float(part.mean()) for part in parts]
    medians = np.array([np.median(spectrum[part], axis=0) for part in parts]) / np.log(2.0)
    logs = np.log(np.maximum(medians, 1e-300))
    places = np.arange(spectrum.shape[0])
    return np.asarray(np.exp(np.column_stack([np.interp(places, middle, column) for column in logs.T])))


def _refined(values: FloatArray, rate: float, start_hz: float) -> float:
    """Return the frequency [Hz] near a line of the spectrum with the largest power of all sensors together."""
    samples = values.shape[0]
    clock = np.arange(samples) / rate
    # demodulated and averaged over short parts, so that each evaluation is small
    parts = min(samples, 256)
    length = samples // parts
    turned = values * np.exp(-2j * np.pi * start_hz * clock)[:, None]
    coarse = turned[: parts * length].reshape(parts, length, -1).mean(axis=1)
    scale = np.linalg.norm(coarse, axis=0)
    coarse = coarse / np.maximum(scale, 1e-300)
    middle = (np.arange(parts) + 0.5) * length / rate

    def power(shift: float) -> float:
        return -float(np.sum(np.abs(np.exp(-2j * np.pi * shift * middle) @ coarse) ** 2))

    reach = rate / samples
    shift = optimize.minimize_scalar(power, bounds=(-reach, reach), method="bounded", options={"xatol": 1e-4 * reach}).x
    return start_hz + float(shift)


def _is_constant(values: FloatArray, rate: float, frequency_hz: float, candidates: int) -> bool:
    """Return whether amplitude and phase at a frequency change less than those of any mode at one of the sensors."""
    samples, sensors = values.shape
    # twice the correlation time of the least damped mode
    longest = np.pi * _LEAST_STRUCTURAL_DAMPING * frequency_hz * samples / rate
    segments = int(min(longest, _MOST_SEGMENTS))
    if segments < _LEAST_SEGMENTS:
        return False
    amplitudes = _amplitudes(values, rate, frequency_hz, segments)
    power = np.maximum(np.sum(np.abs(amplitudes) ** 2, axis=0), 1e-300)
    share = float(np.max(np.abs(amplitudes.sum(axis=0)) ** 2 / power)) / segments
    decay = 2.0 * longest / segments
    # the frequency of a mode may be any of the segments' lines, and was chosen among the candidates
    tried = candidates * sensors * segments
    return bool(tried * chance(share, segments, decay) < _LEVEL)


def _amplitudes(values: FloatArray, rate: float, frequency_hz: float, segments: int) -> ComplexArray:
    """Return the complex amplitude of each sensor at a frequency in each segment, shape (segments, s)."""
    length = values.shape[0] // segments
    wave = np.exp(-2j * np.pi * frequency_hz * np.arange(segments * length) / rate)
    turned = (values[: segments * length] * wave[:, None]).reshape(segments, length, -1)
    return np.asarray(np.einsum("t,mts->ms", np.sin(np.pi * (np.arange(length) + 0.5) / length), turned))


def chance(share: float, segments: int, decay: float) -> float:
    """Return the probability that the mean amplitude of a mode has at least a share of the power of the segments.

    Parameters
    ----------
    share
        Power of the mean over the mean power, between 0 and 1.
    segments
        Number of segments.
    decay
        Length of a segment over the correlation time of the mode.
    """
    place = (np.arange(_QUADRATURE) + 0.5) / _QUADRATURE
    window = np.sin(np.pi * place)
    own = float(window @ np.exp(-decay * np.abs(place[:, None] - place[None, :])) @ window)
    ends = float(window @ np.exp(-decay * place)) * float(window @ np.exp(-decay * (1.0 - place)))
    lags = np.abs(np.subtract.outer(np.arange(segments), np.arange(segments)))
    covariance = np.where(lags == 0, own, ends * np.exp(-decay * (lags - 1.0)))
    form = np.full((segments, segments), 1.0 / segments) - share * np.eye(segments)
    values = np.sort(np.linalg.eigvals(form @ covariance).real)
    largest = float(values[-1])
    if largest <= 0.0:
        return 0.0
    return float(np.exp(-np.sum(np.log1p(np.abs(values[:-1]) / largest))))
