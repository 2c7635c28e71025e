"""The noise that a displacement sensor adds to every test, and its removal from the motion.

The tests of a campaign share one displacement sensor, but each moves at other frequencies. At each frequency the
quietest tests therefore show the noise of the sensor alone, whether it is white, coloured or hum. With its density the
motion of each test is estimated by the non-causal filter of Wiener (Extrapolation, Interpolation, and Smoothing of
Stationary Time Series, 1949): every frequency passes with the share of its power that is motion. No force is read, so
the filter may be applied to tests on which a model is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import fft, ndimage, signal, stats

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.signals.prepared import PreparedTest

SEGMENT_S = 2.0
"""Numerical technique: length of the segments of which the density of a test is averaged."""

QUIETEST = 0.25
"""Share of the tests that show the noise of the sensor alone at a frequency."""

HARMONICS = 4.0
"""Below this multiple of the frequency of the motion every test may hold motion."""

SMOOTHED_BINS = 31
"""Numerical technique: number of frequencies over which the density of the noise is smoothed."""

MAINS_HZ = (50.0, 60.0)
"""Frequencies of the mains, at whose multiples all tests may hold hum."""

LINE = 4.0
"""Hum exceeds the smoothed density this many times in the quietest tests."""

TAPS = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
"""Numerical technique: weights by which neighbouring frequencies of one test are averaged."""

FALSE_ALARM = 1e-6
"""Probability with which noise alone passes at some frequency of a test."""

BROAD_HZ = 2.0
"""Numerical technique: width over which the median shows motion without lines."""

BROAD_RATIO = 3.0
"""A band whose median exceeds the noise this many times holds motion."""

GAP = 3.5
"""Above the first gap in which nothing passes up to this multiple of a frequency, nothing is taken for motion. A
triangle has gaps from its first to its third harmonic."""

LOST = 2.0
"""Motion that does not pass is looked for up to this multiple of the highest frequency that passes."""

MOST_LEVEL = 4.0
"""Most power of the noise of one test, in units of the shared one. Jumps of a channel that was stuck look like more."""

FEWEST = 9
"""Numerical technique: fewest samples from which the curvature at an end of a record is estimated."""

PARABOLA_FITS = 1.5
"""Numerical technique: a parabola fits if it leaves at most this multiple of the noise."""


@dataclass(frozen=True)
class NoiseDensity:
    """Power density of the noise of a sensor.

    Attributes
    ----------
    frequency_hz, density
        Frequencies [Hz] and one-sided density [m^2/Hz], shape (m,).
    """

    frequency_hz: FloatArray
    density: FloatArray

    def at(self, frequency_hz: FloatArray) -> FloatArray:
        """Return the density at other frequencies [m^2/Hz]; constant beyond the ends."""
        return np.asarray(np.interp(frequency_hz, self.frequency_hz, self.density), dtype=np.float64)


def shared_noise(tests: Sequence[PreparedTest]) -> NoiseDensity | None:
    """Return the density of the noise that the displacement of all tests holds; None where it cannot be seen.

    Parameters
    ----------
    tests
        Prepared tests of one sensor, with unequal motion. Where all of them hold the same random motion, the motion
        looks like noise: whether the estimate is of use shows in the error of models.
    """
    moving = [test for test in tests if np.ptp(test.displacement_raw_m) > 0.0 and test.motion_frequency_hz > 0.0]
    if not moving:
        return None
    spectra = [_density(test) for test in moving]
    step = max(frequency[1] for frequency, _ in spectra)
    top = min(frequency[-1] for frequency, _ in spectra)
    frequency = np.arange(step, 0.95 * top, step)
    typical_hz = float(np.median([test.motion_frequency_hz for test in moving]))
    lowest = int(np.searchsorted(frequency, max(HARMONICS * typical_hz, 6.0 * step)))
    if lowest + SMOOTHED_BINS > len(frequency):
        return None
    valleys = np.array([np.interp(frequency, *_between_lines(test)) for test in moving])
    quiet = np.quantile(valleys, QUIETEST, axis=0)
    quiet[:lowest] = np.median(quiet[lowest : lowest + SMOOTHED_BINS])
    smooth = ndimage.median_filter(quiet, SMOOTHED_BINS, mode="nearest")
    # a quantile is low: it is scaled to the typical test where no test holds motion
    upper = frequency > 0.5 * top
    smooth *= float(np.median(np.mean(valleys[:, upper] / np.maximum(smooth[upper], 1e-300), axis=1)))
    lines = np.quantile([np.interp(frequency, *spectrum) for spectrum in spectra], QUIETEST, axis=0)
    density = np.where(_near_mains(frequency, step) & (lines > LINE * smooth), lines, smooth)
    return NoiseDensity(frequency, density) if np.all(density > 0.0) else None


def quiet_motion(tests: Sequence[PreparedTest], noise: NoiseDensity) -> list[PreparedTest]:
    """Return the tests with their unfiltered displacement replaced by the estimated motion.

    `displacement_noise_m` and `displacement_noise_band_hz` then describe the error that remains: noise that passes, and
    motion that does not. `displacement_noise_repeats` is the share of it that repeats where the motion repeats, and
    `motion_band_hz` the highest frequency that passes.

    Parameters
    ----------
    tests
        Prepared tests.
    noise
        Noise from :func:`shared_noise`.
    """
    return [_quiet(test, noise) for test in tests]


def _density(test: PreparedTest, segment_s: float = SEGMENT_S) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and density [m^2/Hz] of a displacement; the window leaks 92 dB less than its peak."""
    values, rate = test.displacement_raw_m, test.sampling_rate_hz
    length = int(min(segment_s * rate, len(values) // 2))
    frequency, density = signal.welch(
        values, fs=rate, nperseg=length, window="blackmanharris", detrend="linear", average="median"
    )
    return np.asarray(frequency), np.asarray(density)


def _between_lines(test: PreparedTest) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and the density of a displacement between the harmonics of its motion [m^2/Hz].

    A machine distorts every sine in the same way, so that harmonics are in all tests and look like noise.
    """
    frequency, density = _density(test, np.inf)
    width = max(2 * SMOOTHED_BINS // 3, round(3.0 * test.motion_frequency_hz / frequency[1]))
    low = ndimage.percentile_filter(density, 100.0 * QUIETEST, size=width, mode="nearest")
    upper = (frequency > 0.5 * frequency[-1]) & (frequency < 0.95 * frequency[-1])
    return frequency, np.asarray(low * np.mean(density[upper]) / max(float(np.mean(low[upper])), 1e-300))


def _near_mains(frequency_hz: FloatArray, step_hz: float) -> BoolArray:
    """Return which frequencies are within the main lobe of a line of the mains, shape (m,)."""
    distance = np.min([np.abs(frequency_hz - mains * np.round(frequency_hz / mains)) for mains in MAINS_HZ], axis=0)
    return np.asarray((distance <= 4.0 * step_hz) & (frequency_hz > 0.5 * min(MAINS_HZ)))


def _quiet(test: PreparedTest, noise: NoiseDensity) -> PreparedTest:
    values, rate = test.displacement_raw_m, test.sampling_rate_hz
    if np.ptp(values) == 0.0:
        return test
    count = len(values)
    step = rate / (2.0 * (count - 1))
    frequency = step * np.arange(1, count - 1)
    expected = noise.at(np.asarray(frequency)) * _level(test, noise)
    trend = _ends(values, rate, test.motion_frequency_hz, float(np.sqrt(np.sum(expected) * step)))
    # a series of sines is the odd continuation at both ends: without value and curvature there it has no jump
    lines = fft.dst(values[1:-1] - trend[1:-1], type=1) / (count - 1)
    power = lines**2 / (2.0 * step)
    passed = _passed(power, expected, step)
    motion = trend.copy()
    motion[1:-1] += 0.5 * fft.dst(passed * lines, type=1)
    held = np.flatnonzero(passed > 0.5)
    # what does not pass holds motion as far as its power exceeds that of the noise, up to the power of the noise
    near = (passed == 0.0) & (np.arange(len(passed)) < LOST * (held[-1] + 1 if len(held) else 0))
    lost = np.clip(np.sum((power - expected)[near]) / max(float(np.sum(expected[near])), 1e-300), 0.0, 1.0)
    error = np.where(near, lost, passed) * expected * step
    lasting = float(np.sum(error[near]) + test.rounding_share * np.sum(error[~near]))
    remains, speed = (np.sqrt(np.sum(weight * error)) for weight in (1.0, (2.0 * np.pi * frequency) ** 2))
    return replace(
        test,
        displacement_raw_m=motion,
        recorded_step_m=test.displacement_step_m,
        recorded_dither_m=test.displacement_dither_m,
        displacement_noise_m=float(remains),
        displacement_noise_band_hz=float(np.sqrt(3.0) * speed / (2.0 * np.pi * max(remains, 1e-300))),
        displacement_noise_repeats=lasting / max(float(np.sum(error)), 1e-300),
        motion_band_hz=float(frequency[held[-1]]) if len(held) else float(frequency[0]),
    )


def _ends(values: FloatArray, rate_hz: float, motion_hz: float, deviation: float) -> FloatArray:
    """Return the cubic polynomial with the value and the curvature that a record has at its ends, shape (n,).

    Parameters
    ----------
    values
        Record [m], shape (n,).
    rate_hz, motion_hz
        Sampling rate, and frequency of the motion.
    deviation
        Standard deviation of its noise [m].
    """
    count = len(values)
    longest = int(np.clip(rate_hz / (16.0 * max(motion_hz, 1e-3)), FEWEST, max(FEWEST, count // 4)))
    first, last = (_parabola(piece, longest, deviation) for piece in (values, values[::-1]))
    place = np.arange(count) / (count - 1)
    span = float(count - 1) ** 2
    a, b = 2.0 * first[0] * span, 2.0 * last[0] * span
    line = first[2] + (last[2] - first[2]) * place
    bend = a * (place**2 / 2.0 - place**3 / 6.0 - place / 3.0) + b * (place**3 - place) / 6.0
    return np.asarray(line + bend, dtype=np.float64)


def _parabola(values: FloatArray, longest: int, deviation: float) -> FloatArray:
    """Return the parabola at the beginning of a record, over as many samples as it fits within the noise; shape (3,).

    A corner of a triangle near the end would feign a curvature.
    """
    few = longest
    while True:
        index = np.arange(few)
        found = np.polyfit(index, values[:few], 2)
        left = float(np.std(values[:few] - np.polyval(found, index)))
        if few <= FEWEST or left < PARABOLA_FITS * deviation:
            return np.asarray(found, dtype=np.float64)
        few = max(FEWEST, few // 2)


def _level(test: PreparedTest, noise: NoiseDensity) -> float:
    """Return how many times the shared density the noise of one test is, where no test holds motion."""
    frequency, density = _density(test)
    upper = (frequency > 0.5 * noise.frequency_hz[-1]) & (frequency <= noise.frequency_hz[-1])
    if not upper.any():
        return 1.0
    return float(np.clip(np.mean(density[upper] / noise.at(frequency)[upper]), 1.0, MOST_LEVEL))


def _passed(power: FloatArray, noise: FloatArray, step_hz: float) -> FloatArray:
    """Return the share of each frequency that is motion, from 0 to 1, shape (n,).

    A frequency passes only where noise alone would hardly ever reach its power: as a line, or within a broad band.
    """
    freedoms = 1.0 / float(np.sum(TAPS**2))
    least = float(stats.chi2.isf(FALSE_ALARM / len(power), freedoms)) / freedoms
    line = np.convolve(power, TAPS, mode="same") / noise
    width = max(32, round(BROAD_HZ / step_hz))
    blocks = np.array_split(np.arange(len(power)), max(1, len(power) // width))
    middles = np.array([float(np.mean(block)) for block in blocks])
    medians = np.array([float(np.median(power[block] / noise[block])) for block in blocks]) / stats.chi2.median(1)
    broad = np.interp(np.arange(len(power)), middles, medians)
    ratio = np.maximum(np.where(line > least, line, 0.0), np.where(broad > BROAD_RATIO, broad, 0.0))
    held = np.flatnonzero(ratio > 0.0)
    gaps = np.flatnonzero(held[1:] + 1 > GAP * (held[:-1] + 1))
    if len(gaps):
        ratio[held[gaps[0]] + 1 :] = 0.0
    return np.asarray(np.where(ratio > 0.0, 1.0 - 1.0 / np.maximum(ratio, 1.0), 0.0), dtype=np.float64)
