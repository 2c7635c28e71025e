"""Motion from displacement and acceleration together.

A displacement sensor has too much noise at high frequencies, because differentiation amplifies it; an accelerometer
has too much at low frequencies, because integration does. The motion that agrees best with both, each weighted by its
noise, follows the displacement below a crossover frequency and the acceleration above it. This is the smoother for a
mass of unknown acceleration: Hong, Kim, Lee and Lee 2010, Computer-Aided Civil and Infrastructure Engineering 25,
299-312 (regularised reconstruction on a time window); Smyth and Wu 2007, Mechanical Systems and Signal Processing 21,
706-723 (Kalman smoother).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize, signal

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.signals.filters import advance
from mrpipe.signals.spectra import averaged
from mrpipe.words import in_percent

LATEST_S = 0.02
"""Largest delay between the two sensors that is searched [s]."""

WINDOW_S = 1.5
"""Length of the windows of the spectra [s]; shorter tests are one window."""

HIGHEST_SHARE = 0.35
"""Share of the sampling rate up to which the sensors are compared; anti-aliasing filters act beyond it."""

LEAST_COHERENCE = 0.5
"""Coherence that some frequency must reach; otherwise the sensors do not measure the same motion."""

WORTHWHILE_SHARE = 0.1
"""Share of the power of the velocity above the crossover from which the accelerometer is recommended."""

SMOOTHED = 0.06
"""Numerical technique: share of a frequency, to either side, over which densities are averaged for the coherence."""

LEAST_AGREEMENT = 0.5
"""Mean cosine of the phase between the sensors that is needed after the delay is corrected."""

EQUAL_AGREEMENT = 0.99
"""Numerical technique: share of the largest agreement from which the shortest delay is taken."""

NOISE_BAND_HZ = 100.0
"""Numerical technique: the noise is compared up to this frequency [Hz], or up to the highest one of the motion."""

CHANCE = 3.0
"""Numerical technique: coherence of independent noise, which is exceeded in one of 20 cases, times the averages."""

START_MISMATCHES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)
"""Numerical technique: shares of the motion, in the difference of the sensors, from which the search starts."""

LOGARITHMS = ((-100.0, 100.0),) * 3
"""Numerical technique: bounds of the logarithms of the two densities of noise and of this share."""

LARGEST_COHERENCE = 0.999
"""Numerical technique: coherence above which all frequencies have the same weight."""

LEAST_WINDOWS = 8
"""Numerical technique: least number of windows of the spectra, because one window has a coherence of 1."""

FEWEST_LINES = 8
"""Numerical technique: least number of frequencies at which the sensors are compared."""

GAIN_STEPS = 3
"""Numerical technique: number of times that the gain and the noise are estimated in turn."""

LOWEST_CROSSOVER_HZ = 0.2
"""Numerical technique: lowest crossover frequency [Hz]; below it the equations are badly conditioned."""


@dataclass(frozen=True)
class SensorAgreement:
    """How displacement and acceleration of a campaign fit together.

    Attributes
    ----------
    gain
        Ratio of the acceleration to the second derivative of the displacement.
    displacement_late_s
        Time by which the displacement is recorded later than the acceleration [s].
    crossover_hz
        Frequency [Hz] at which the noise of both sensors, as an acceleration, is equal.
    velocity_share
        Share of the power of the velocity above the crossover, where the accelerometer has less noise.
    """

    gain: float
    displacement_late_s: float
    crossover_hz: float
    velocity_share: float = 0.0

    @property
    def worthwhile(self) -> bool:
        """Whether the motion from both sensors has a clearly better velocity than the displacement alone."""
        return self.velocity_share >= WORTHWHILE_SHARE

    @property
    def advice(self) -> str:
        """Finding for a user who takes the motion from the displacement alone."""
        return (
            f"above {self.crossover_hz:.3g} Hz the accelerometer has less noise than the displacement sensor, and "
            f"{in_percent(self.velocity_share)} of the power of the velocity lies there: consider "
            "prepare.motion=displacement-and-acceleration"
        )

    @property
    def line(self) -> str:
        """Finding for the user."""
        late = 1e3 * self.displacement_late_s
        order = f"{abs(late):.2f} ms {'later' if late >= 0.0 else 'earlier'} than"
        return (
            f"the motion follows the displacement below {self.crossover_hz:.3g} Hz and the acceleration above it; the "
            f"displacement is recorded {order} the acceleration, and the acceleration is {self.gain:.3g} times the "
            "second derivative of the displacement (both are corrected in the acceleration)"
        )


@dataclass(frozen=True)
class _Spectra:
    """Densities over angular frequency [rad/s] of second difference and acceleration, and their cross density.

    Attributes
    ----------
    omega
        Angular frequency, shape (f,) [rad/s].
    amplification
        Density of the second difference over that of the displacement, shape (f,) [1/s4].
    response
        Share of white noise that the acceleration keeps where it is compared with a second difference, shape (f,).
    motion, acceleration, cross
        Densities of the second difference of the displacement and of the acceleration, and their cross density (f,).
    averages
        Number of independent densities that were averaged, shape (f,).
    """

    omega: FloatArray
    amplification: FloatArray
    response: FloatArray
    motion: FloatArray
    acceleration: FloatArray
    cross: NDArray[np.complex128]
    averages: FloatArray

    def up_to(self, count: int) -> _Spectra:
        """Return the first `count` frequencies."""
        return _Spectra(*(getattr(self, item.name)[:count] for item in fields(self)))

    @property
    def coherence(self) -> FloatArray:
        """Squared coherence, shape (f,), without the part that independent noise has in so few averages."""
        raw = np.abs(self.cross) ** 2 / np.maximum(self.motion * self.acceleration, 1e-300)
        chance = CHANCE / self.averages
        return np.asarray(np.clip((raw - chance) / (1.0 - chance), 0.0, 1.0))

    @property
    def weight(self) -> FloatArray:
        """Number in proportion to the inverse variance of the phase of the transfer function, shape (f,)."""
        inside = np.minimum(self.coherence, LARGEST_COHERENCE)
        return np.where(inside >= LEAST_COHERENCE, inside / (1.0 - inside), 0.0)


@dataclass(frozen=True)
class _Noise:
    """Densities of the noise of two sensors of one motion.

    Attributes
    ----------
    acceleration, displacement
        White noise of the accelerometer [(m/s2)2/Hz] and of the displacement sensor [m2/Hz].
    mismatch
        Density in proportion to that of the motion, shape (f,): the sensors may be at slightly different places, or not
        be linear. It belongs to neither, and without it, it would be taken for noise.
    """

    acceleration: float
    displacement: float
    mismatch: FloatArray


def sensor_agreement(pairs: Sequence[tuple[FloatArray, FloatArray]], sampling_rate_hz: float) -> SensorAgreement:
    """Return gain, delay and noise of the two sensors, from all tests of a campaign together.

    Parameters
    ----------
    pairs
        Displacement [m] and acceleration [m/s2] of each test, shape (n,) each; their signs agree.
    sampling_rate_hz
        Sampling rate [Hz].

    Raises
    ------
    UserError
        If the tests are too short, or the two sensors do not measure the same motion at any frequency.
    """
    first = _pooled(pairs, sampling_rate_hz)
    if first.omega.size < FEWEST_LINES:
        raise UserError(
            "prepare",
            "motion",
            "is displacement-and-acceleration, but the tests are too short to compare the two sensors",
            "give longer tests, or set prepare.motion to displacement",
        )
    late = _delay(first)
    # windows at different times would show a difference that neither sensor has
    aligned = [(x, advance(a, -late, sampling_rate_hz)) for x, a in pairs]
    spectra = _pooled(aligned, sampling_rate_hz)
    late += _delay(spectra)
    common = np.flatnonzero(spectra.coherence >= LEAST_COHERENCE)
    if common.size == 0:
        highest = spectra.coherence.max(initial=0.0)
        raise UserError(
            "prepare",
            "motion",
            f"is displacement-and-acceleration, but the coherence of the two is at most {highest:.2f}",
            "check the column and the place of the accelerometer, or set prepare.motion to displacement",
        )
    if _agreement(spectra) < LEAST_AGREEMENT:
        raise UserError(
            "prepare",
            "motion",
            "is displacement-and-acceleration, but their phases do not agree with one delay of at most "
            f"{1e3 * LATEST_S:g} ms",
            "check the column, the place and the direction of the accelerometer, or set prepare.motion to displacement",
        )
    # far beyond the motion, the noise of most sensors is not white
    highest = max(float(spectra.omega[common[-1]]), 2.0 * np.pi * NOISE_BAND_HZ)
    seen = spectra.up_to(int(np.searchsorted(spectra.omega, highest, side="right")))
    gain = float(np.average(np.real(seen.cross / seen.motion), weights=seen.weight**2))
    for _ in range(GAIN_STEPS):
        noise = _noise(seen, gain)
        gain = _gain(seen, gain, noise)
    crossover = (noise.acceleration / noise.displacement) ** 0.25 / (2.0 * np.pi)
    frequency = seen.omega / (2.0 * np.pi)
    crossover = float(np.clip(crossover, LOWEST_CROSSOVER_HZ, frequency[-1]))
    velocity = seen.coherence * seen.motion / seen.omega**2
    share = float(np.sum(velocity[frequency > crossover]) / np.sum(velocity))
    return SensorAgreement(gain, late, crossover, share)


def fused_displacement(
    displacement: FloatArray, acceleration: FloatArray, sampling_rate_hz: float, crossover_hz: float
) -> FloatArray:
    """Return the motion that agrees best with displacement and acceleration, shape (n,) [m].

    It minimises ``sum (y - x)^2 + (1 / omega^4) sum (D y - a)^2`` with the second difference D and the crossover omega.
    A constant offset of the accelerometer changes the ends only.

    Parameters
    ----------
    displacement, acceleration
        Measured x [m] and a [m/s2] on one clock and with the same sensitivity, shape (n,).
    sampling_rate_hz
        Sampling rate [Hz].
    crossover_hz
        Frequency above which the acceleration has the larger weight.
    """
    ratio = (sampling_rate_hz / (2.0 * np.pi * crossover_hz)) ** 4
    own, measured = _accelerations(displacement, acceleration, sampling_rate_hz)
    missing = ratio / sampling_rate_hz**2 * (measured - own)
    right = np.zeros(displacement.size)
    right[:-2] += missing
    right[1:-1] -= 2.0 * missing
    right[2:] += missing
    return np.asarray(displacement + linalg.solveh_banded(_normal_equations(displacement.size, ratio), right))


def on_displacement_clock(acceleration: FloatArray, found: SensorAgreement, sampling_rate_hz: float) -> FloatArray:
    """Return the acceleration with the delay and the sensitivity of the displacement, shape (n,) [m/s2]."""
    return advance(acceleration, -found.displacement_late_s, sampling_rate_hz) / found.gain


def _normal_equations(count: int, ratio: float) -> FloatArray:
    """Return ``I + ratio D'D`` in the upper banded form of `scipy.linalg.solveh_banded`, shape (3, n)."""
    bands = np.zeros((3, count))
    bands[2] = 1.0
    for place, value in enumerate((1.0, 4.0, 1.0)):
        bands[2, place : count - 2 + place] += ratio * value
    bands[1, 1:] -= 4.0 * ratio
    bands[1, [1, -1]] += 2.0 * ratio
    bands[0, 2:] += ratio
    return bands


def _accelerations(displacement: FloatArray, acceleration: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return the second difference of the displacement and the acceleration that it would have, shape (n - 2,) each."""
    # three samples of the acceleration are equal to a second difference up to fourth order (Numerov)
    smooth = (acceleration[:-2] + 10.0 * acceleration[1:-1] + acceleration[2:]) / 12.0
    return np.diff(displacement, 2) * rate**2, smooth


def _pooled(pairs: Sequence[tuple[FloatArray, FloatArray]], rate: float) -> _Spectra:
    """Return the mean spectra of all tests, weighted by their length."""
    total = sum(item.size for item, _ in pairs)
    length = min([round(WINDOW_S * rate), total // LEAST_WINDOWS, *(item.size - 2 for item, _ in pairs)])
    sums = np.zeros((4, length // 2 + 1))
    frequency = np.asarray(np.arange(length // 2 + 1) * (rate / length), dtype=np.float64)
    for pair in pairs:
        d, a = _accelerations(*pair, rate)
        for place, (first, second) in enumerate(((d, d), (a, a), (d, a))):
            density = first.size / total * signal.csd(first, second, rate, nperseg=length)[1]
            sums[place] += np.real(density)
            # only the last one is complex
            sums[3] += np.imag(density)
    smooth = [averaged(frequency, item, SMOOTHED, 2) for item in sums]
    motion, acceleration, even, odd = (item for item, _ in smooth)
    averages = smooth[0][1] * total / length
    # the first two bins hold the mean that was removed
    band = (np.arange(frequency.size) >= 2) & (frequency <= HIGHEST_SHARE * rate)
    omega = np.asarray(2.0 * np.pi * frequency[band], dtype=np.float64)
    amplification = np.asarray((2.0 * rate * np.sin(omega / (2.0 * rate))) ** 4, dtype=np.float64)
    response = np.asarray(((10.0 + 2.0 * np.cos(omega / rate)) / 12.0) ** 2, dtype=np.float64)
    cross = even[band] + 1j * odd[band]
    return _Spectra(omega, amplification, response, motion[band], acceleration[band], cross, averages[band])


def _delay(spectra: _Spectra) -> float:
    """Return the delay [s] with which the transfer function is a positive constant."""
    omega = spectra.omega
    direction = spectra.weight * spectra.cross / np.maximum(np.abs(spectra.cross), 1e-300)

    def agreement(late: float) -> float:
        return float(np.sum(np.real(direction * np.exp(-1j * omega * late))))

    step = 0.1 / float(omega[-1])
    delays = np.arange(-LATEST_S, LATEST_S + step, step)
    height = np.array([agreement(late) for late in delays])
    peaks = signal.find_peaks(np.concatenate(([-np.inf], height, [-np.inf])))[0] - 1
    # under one sine, delays that differ by a period agree equally
    high = delays[peaks[height[peaks] >= EQUAL_AGREEMENT * height.max()]]
    best = float(high[np.argmin(np.abs(high))]) if high.size else 0.0
    found = optimize.minimize_scalar(lambda late: -agreement(late), bounds=(best - step, best + step), method="bounded")
    return float(found.x)


def _agreement(spectra: _Spectra) -> float:
    """Return the mean cosine of the phase between the sensors: 1 if the transfer function is a positive constant."""
    return float(np.average(np.real(spectra.cross) / np.maximum(np.abs(spectra.cross), 1e-300), weights=spectra.weight))


def _noise(seen: _Spectra, gain: float) -> _Noise:
    """Return the noise of both sensors, by Whittle's likelihood of the parts of both that are not coherent.

    These parts do not depend on the frequency responses of the sensors, as the difference of the accelerations would.
    Where the motion is strong, each part contains the noise of both sensors; elsewhere it is that of its own sensor.
    """
    alone = np.maximum(1.0 - seen.coherence, 1e-300)
    both = np.sqrt(seen.coherence * seen.motion * seen.acceleration) / gain
    motion = seen.coherence * seen.acceleration / gain**2
    # a regression leaves a part of the noise of its input: none where the input is noise alone
    of_displacement = np.minimum(both / seen.motion, 1.0)
    of_acceleration = np.minimum(both * gain**2 / seen.acceleration, 1.0)
    observed = np.concatenate([alone * seen.acceleration / gain**2, alone * seen.motion])
    parts = np.stack(
        [
            np.concatenate([np.ones_like(motion), of_acceleration]) * np.tile(seen.response, 2),
            np.concatenate([of_displacement, np.ones_like(motion)]) * np.tile(seen.amplification, 2),
            np.tile(motion, 2),
        ]
    )

    def shortfall(logarithms: FloatArray) -> tuple[float, FloatArray]:
        each = np.exp(logarithms)[:, None] * parts
        expected = each.sum(axis=0)
        value = np.sum(np.log(expected) + observed / expected)
        return float(value), np.asarray(np.sum(each * (1.0 - observed / expected) / expected, axis=1))

    first, second = np.split(observed, 2)
    levels = np.median(first), np.median(second / seen.amplification)
    starts = [np.log([*levels, share]) for share in START_MISMATCHES]
    ways = [optimize.minimize(shortfall, start, jac=True, bounds=LOGARITHMS) for start in starts]
    found = min(ways, key=lambda way: float(way.fun))
    acceleration, displacement, share = np.exp(found.x)
    return _Noise(float(acceleration), float(displacement), share * motion)


def _gain(seen: _Spectra, start: float, noise: _Noise) -> float:
    """Return the gain, by least squares with errors in both sensors."""

    def difference(gain: float) -> FloatArray:
        return np.asarray(seen.acceleration + gain**2 * seen.motion - 2.0 * gain * np.real(seen.cross))

    def left(gain: float) -> float:
        expected = (
            start**2 * (noise.acceleration * seen.response + noise.mismatch)
            + gain**2 * noise.displacement * seen.amplification
        )
        return float(np.sum(difference(gain) / expected))

    ends = sorted((0.5 * start, 2.0 * start))
    return float(optimize.minimize_scalar(left, bounds=(ends[0], ends[1]), method="bounded").x)
