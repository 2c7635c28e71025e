"""Noise of the sensors of a structure: its level above the band, and its colour.

The noise in the band of the motion cannot be seen. It follows from the noise above the band: white noise has the same
density there, coloured noise has that of an autoregressive process of first order (AR(1)), which rises towards low
frequencies. The upper half of the frequencies above the band, where a structure hardly moves, shows whether the noise
is coloured, by Whittle's likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import signal, stats

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.records import FrameRecord

NOISE_BLOCKS = 14
"""Numerical technique: least number of blocks over which the spectrum of a sensor's noise is averaged."""

NOISE_PARTS, LEAST_PART, FEWEST_PARTS = 8, 250, 3
"""Numerical technique: number of parts of a record whose noise is estimated separately, least number of samples of a
part, and least number of parts."""

ABOVE_BAND, HIGHEST_START, HIGHEST = 1.25, 0.3, 0.45
"""Numerical technique: sensor noise is measured between two frequencies. The lower one is the first number times the
upper edge of the band, but at most the second number times the sampling rate; the upper one is the third number times
the sampling rate."""

COLOURS = tuple(float(value) for value in np.linspace(0.0, 0.98, 99))
"""Numerical technique: coefficients of the autoregressive process that are compared; 0 is white noise."""

FEWEST_LINES = 4
"""Numerical technique: least number of lines above the band from which a colour is estimated."""

EQUALLY_LIKELY = 3.0
"""Numerical technique: colours whose logarithm of the likelihood is less than this below the largest one are possible
..."""

MOST_COLOURS = 6
"""Numerical technique: ... and largest number of possible colours that are compared in the band."""


@dataclass(frozen=True)
class Noise:
    """Noise of the sensors of a record.

    Attributes
    ----------
    acceleration
        Power density of ground and floor accelerometers, shape (1 + n,) [(m/s2)^2/Hz]; that of the innovations where
        the noise is coloured.
    displacement
        Floor -> power density of its laser [m2/Hz].
    loads
        Floor -> power density of the load cell there [N2/Hz].
    colour
        Coefficient of the autoregressive process of the accelerometers; 0 if their noise is white.
    rate_hz
        Sampling rate [Hz].
    turning
        Power density of the angular accelerations of the floors, shape (turns,) [(rad/s2)^2/Hz].
    """

    acceleration: FloatArray
    displacement: dict[int, float]
    loads: dict[int, float] = field(default_factory=dict)
    colour: float = 0.0
    rate_hz: float = 1.0
    turning: FloatArray = field(default_factory=lambda: np.zeros(0))

    def of_accelerometers(self, frequencies_hz: FloatArray) -> FloatArray:
        """Return the power density of ground and floor accelerometers at frequencies, shape (1 + n, f)."""
        return np.asarray(self.acceleration[:, None] * shape_of(self.colour, frequencies_hz / self.rate_hz))

    def of_turning(self, frequencies_hz: FloatArray) -> FloatArray:
        """Return the power density of the angular accelerations at frequencies, shape (turns, f)."""
        return np.asarray(self.turning[:, None] * shape_of(self.colour, frequencies_hz / self.rate_hz))


def shape_of(colour: float, cycles_per_sample: FloatArray) -> FloatArray:
    """Return the density of an autoregressive process of first order over that of its innovations, shape (f,)."""
    return np.asarray(1.0 / (1.0 - 2.0 * colour * np.cos(2.0 * np.pi * cycles_per_sample) + colour**2))


def laser_share(omega: FloatArray, noise: Noise, floor: int) -> FloatArray:
    """Return the weight of a floor's laser relative to its integrated acceleration, 0 to 1, shape (f,)."""
    if floor not in noise.displacement:
        return np.zeros_like(omega)
    sensors = noise.of_accelerometers(omega / (2.0 * np.pi))
    accelerometer = sensors[floor] + sensors[0]
    return np.asarray(accelerometer / (accelerometer + noise.displacement[floor] * omega**4))


def noise_density(
    values: FloatArray, rate_hz: float, above_hz: float, quietest: float | None = None, colour: float = 0.0
) -> float:
    """Return the power density of the noise on a channel, measured above the band [unit^2/Hz].

    Slip and impact cause vibration far above the band, but not while a frame rests or moves little. The noise is
    therefore estimated in the quieter parts of a record.

    Parameters
    ----------
    values
        The channel, shape (m,).
    rate_hz
        Sampling rate [Hz].
    above_hz
        Upper edge of the band.
    quietest
        Least share of the density of the whole record that is returned; the default of the rules if None.
    colour
        Coefficient of the autoregressive process; the density is that of its innovations.
    """
    return _quiet_density(_averages_of(values, rate_hz), above_hz, quietest, colour)


def _quiet_density(averages: _Averages, above_hz: float, quietest: float | None, colour: float) -> float:
    quietest = FrameRules().quietest if quietest is None else quietest
    whole, pieces, rate_hz = averages.whole.level(above_hz, colour), averages.pieces, averages.whole.rate_hz
    if len(pieces) < FEWEST_PARTS:
        return whole
    levels = sorted(piece.level(above_hz, colour) for piece in pieces)
    # expected distance of the second smallest level from the mean, in standard deviations (Blom); the deviation of a
    # level follows from its number of lines
    below = -float(stats.norm.ppf((2.0 - 0.375) / (len(pieces) + 0.25)))
    inside = pieces[0].samples * max(0.9 - 2.0 * min(above_hz / rate_hz, 0.3), 0.1)
    quiet = levels[1] / (1.0 - below * min(0.7, np.sqrt(3.5 / inside)))
    return float(min(max(quiet, quietest * whole), whole))


def possible_colours(records: Sequence[FrameRecord], band_high_hz: float) -> tuple[float, ...]:
    """Return coefficients of the autoregressive process that agree equally well with the noise above the band.

    All floor sensors of a structure are taken to have the same one. The frequencies above the band do not determine how
    far coloured noise rises towards low frequencies, so that several coefficients may be returned.

    Parameters
    ----------
    records
        Records of the structure.
    band_high_hz
        Upper edge of the band.

    Returns
    -------
    tuple of float
        In rising order; (0.0,) if nothing speaks against white noise. Otherwise white noise is the first one, because
        vibration that an effect causes far above the band may look like coloured noise.
    """
    costs, count = np.zeros(len(COLOURS)), 0.0
    for record in records:
        for channel in record.acceleration.T:
            own, lines = _costs(channel, record.rate_hz, ABOVE_BAND * band_high_hz)
            costs, count = costs + own, count + lines
    if count == 0.0 or 2.0 * (costs[0] - costs.min()) <= np.log(count):
        return (0.0,)
    equal = [colour for colour, cost in zip(COLOURS, costs, strict=True) if cost <= costs.min() + EQUALLY_LIKELY]
    places = np.unique(np.linspace(0, len(equal) - 1, min(len(equal), MOST_COLOURS)).astype(int))
    return (0.0, *(equal[place] for place in places))


def _costs(values: FloatArray, rate_hz: float, above_hz: float) -> tuple[FloatArray, float]:
    """Return negative logarithms of the likelihood of each colour, and the number of independent lines."""
    pieces = _pieces(values)
    pieces.sort(key=lambda piece: _average(piece, rate_hz).level(above_hz))
    # slip and impact cause vibration above the band in the louder parts
    quiet = pieces[: max(1, len(pieces) // 2)]
    length = min(_block(piece) for piece in quiet)
    spectra = [signal.welch(piece - np.mean(piece), rate_hz, nperseg=length) for piece in quiet]
    frequencies, density = spectra[0][0], np.mean([item for _, item in spectra], axis=0)
    above = _above(frequencies, rate_hz, above_hz)
    # just above the band there still is motion of the structure
    middle = 0.5 * (float(np.min(frequencies[above], initial=HIGHEST * rate_hz)) + HIGHEST * rate_hz)
    upper = above & (frequencies > middle)
    if np.count_nonzero(upper) < FEWEST_LINES:
        return np.zeros(len(COLOURS)), 0.0
    averages = sum(2.0 * len(piece) / length - 1.0 for piece in quiet) / 1.06
    shapes = [shape_of(colour, frequencies[upper] / rate_hz) for colour in COLOURS]
    return averages * np.array([_whittle(density[upper], shape) for shape in shapes]), averages * float(upper.sum())


def noise_of(record: FrameRecord, band_high_hz: float, rules: FrameRules | None = None, colour: float = 0.0) -> Noise:
    """Return the noise of a record's sensors, measured above the band.

    Parameters
    ----------
    record
        The record.
    band_high_hz
        Upper edge of the band.
    rules
        Decision thresholds; their defaults if None.
    colour
        Coefficient of the autoregressive process of the accelerometers' noise; 0: white.
    """
    above, rate, quietest = ABOVE_BAND * band_high_hz, record.rate_hz, (rules or FrameRules()).quietest

    def density(kind: str, number: int, values: FloatArray, colour: float = 0.0) -> float:
        key = (kind, number)
        if key not in record.averages:
            record.averages[key] = _averages_of(values, rate)
        return _quiet_density(record.averages[key], above, quietest, colour)

    channels = (record.ground, *record.acceleration.T)
    densities = np.array([density("acceleration", k, item, colour) for k, item in enumerate(channels)])
    sensors = [floor for floor in range(1, densities.size) if floor not in record.computed]
    # above the band the computed motion of a floor vanishes, but in the band it contains the noise of its neighbours
    densities[list(record.computed)] = densities[sensors].max(initial=0.0)
    return Noise(
        densities,
        {floor: density("displacement", floor, x) for floor, x in record.measured_displacement.items()},
        {floor: density("load", floor, x) for floor, x in record.known_loads.items()},
        colour,
        rate,
        np.array([density("turning", k, item, colour) for k, item in enumerate(record.turning.T)]),
    )


def _pieces(values: FloatArray) -> list[FloatArray]:
    return np.array_split(values, max(1, min(NOISE_PARTS, len(values) // LEAST_PART)))


def _block(values: FloatArray) -> int:
    return min(2048, max(64, len(values) // NOISE_BLOCKS), len(values))


def _above(frequencies: FloatArray, rate_hz: float, above_hz: float) -> BoolArray:
    return (frequencies > min(above_hz, HIGHEST_START * rate_hz)) & (frequencies < HIGHEST * rate_hz)


@dataclass(frozen=True)
class _Average:
    """Averaged spectrum of a channel, or of a part of it.

    Attributes
    ----------
    frequencies, density
        Frequencies [Hz] and power density [unit^2/Hz], shape (f,).
    rate_hz
        Sampling rate [Hz].
    samples
        Number of samples.
    quartile
        Lower quartile of the density of white noise over its mean; it depends on the number of averaged blocks.
    """

    frequencies: FloatArray
    density: FloatArray
    rate_hz: float
    samples: int
    quartile: float

    def level(self, above_hz: float, colour: float = 0.0) -> float:
        """Return the density above a frequency, that of the innovations where the noise is coloured."""
        high = _above(self.frequencies, self.rate_hz, above_hz)
        # the lower quartile ignores resonances
        shape = shape_of(colour, self.frequencies[high] / self.rate_hz)
        return float(np.quantile(self.density[high] / shape, 0.25)) / self.quartile


@dataclass(frozen=True)
class _Averages:
    """Averaged spectra of a channel and of its parts."""

    whole: _Average
    pieces: tuple[_Average, ...]


def _averages_of(values: FloatArray, rate_hz: float) -> _Averages:
    return _Averages(_average(values, rate_hz), tuple(_average(piece, rate_hz) for piece in _pieces(values)))


def _average(values: FloatArray, rate_hz: float) -> _Average:
    length = _block(values)
    frequencies, density = signal.welch(values - np.mean(values), rate_hz, nperseg=length)
    # half overlapping Hann windows have 1.06 times the variance of separate ones
    freedom = 2.0 * max(1.0, 2.0 * len(values) / length - 1.0) / 1.06
    quartile = float(stats.chi2.ppf(0.25, freedom) / freedom)
    return _Average(frequencies, density, rate_hz, len(values), quartile)


def _whittle(density: FloatArray, shape: FloatArray) -> float:
    """Return the negative logarithm of the likelihood of a shape, with the best level, for one average."""
    return float(density.size * np.log(np.mean(density / shape)) + np.sum(np.log(shape)))
