"""Frequency and damping of modes from the spectra of ambient responses, by maximum likelihood (Whittle).

Subspace identification gives good shapes, but at high model orders it may split a mode into two poles of wrong damping.
The shapes convert the responses to modal coordinates, each of which has one peak and small contributions of the other
modes. The lines of the periodogram of a stationary response are independent and exponentially distributed, with the
spectral density as mean. Frequency and damping of the peak therefore follow from maximum likelihood. Where the strength
of the excitation changes, the lines are not independent, and they count less (stationarity.py).

Sources: Whittle (1953), Estimation and information in stationary time series, Arkiv foer Matematik 2; Au (2011), Fast
Bayesian FFT method for ambient modal identification with separated modes, Journal of Engineering Mechanics 137.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from scipy.optimize import minimize

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.modal.ambient.stationarity import effective_share
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import ComplexArray

_ROUNDS = 2
_MOST_ROUNDS = 6
_LEAST_HALF_WIDTH = 0.08
_LARGEST_HALF_WIDTH = 0.4
"""Share of the frequency of a mode, as half bandwidth, in which the density of the force is one power of the frequency.
"""
_WIDTHS = 8.0
_USUAL_DAMPING = 0.01
_LINES_PER_WIDTH = 12.0
_REACH_FREQUENCY = 0.03
_DAMPING_RANGE = (5e-4, 0.15)
_LEAST_LINES = 24
_RANGE_OF_LEVELS = 20.0
"""Bound on the logarithm of noise and neighbours over the lowest power in the band."""
_LARGEST_EXPONENT = 300.0
_FALSE_PEAK = 1e-3
"""Probability that a second peak is found where there is one."""
_EXPONENT_SPREAD = 2.0
"""Prior standard deviation of the exponent of the frequency: forces of wind fall with up to f^-4."""
_SUPPORT_EXPONENT = -4.0
"""Exponent for motion of the supports: absolute accelerations then follow the displacement of a mode under a force."""
_SOIL_EXPONENT = _SUPPORT_EXPONENT - 2.0
"""Exponent for motion of the supports whose own spectrum falls with f^-2, as that of an earthquake does above the
natural frequency of the soil (Kanai 1957; Tajimi 1960). With the exponent of a flat spectrum alone, the model shifted
frequencies by up to -0.5 % in a short record."""


@dataclass(frozen=True)
class _Lines:
    """Fourier transforms of the modal coordinates of a test, shape (m, r), at angular frequencies, shape (m,)."""

    omega: FloatArray
    values: ComplexArray

    def inside(self, low: float, high: float) -> BoolArray:
        """Return the lines between two frequencies, shape (m,)."""
        return (self.omega >= low) & (self.omega <= high)


@dataclass(frozen=True)
class _Spectrum:
    """Power of a modal coordinate, shape (m,); each value counts as the mean of `count` lines, shape (m,)."""

    omega: FloatArray
    power: FloatArray
    count: FloatArray


def _transforms(tests: Sequence[FrameTest], shapes: FloatArray) -> list[_Lines]:
    """Return the modal coordinates of each test; a line of power has the expectation of the spectral density."""
    unmix = np.linalg.pinv(shapes / np.linalg.norm(shapes, axis=0))
    found = []
    for test in tests:
        values = (test.responses - test.responses.mean(axis=0)) @ unmix.T
        frequency = np.fft.rfftfreq(values.shape[0], 1.0 / test.sampling_rate_hz)
        lines = np.fft.rfft(values, axis=0) / np.sqrt(values.shape[0])
        found.append(_Lines(np.asarray(2.0 * np.pi * frequency, dtype=np.float64), np.asarray(lines)))
    return found


def _near(
    tests: Sequence[tuple[FloatArray, FloatArray, float]], low: float, high: float, width: float
) -> _Spectrum | None:
    """Return a spectrum between two frequencies; close lines are averaged.

    Parameters
    ----------
    tests
        For each test: angular frequencies, power, and the share of the record that counts.
    low, high, width
        Ends of the band and width of the peak [rad/s].
    """
    rows, powers, counts = [], [], []
    for omega, power, share in tests:
        inside = (omega >= low) & (omega <= high)
        line = float(omega[1] - omega[0])
        group = max(1, int(width / _LINES_PER_WIDTH / line))
        length = int(np.count_nonzero(inside)) // group * group
        if length < group:
            continue
        rows.append(omega[inside][:length].reshape(-1, group).mean(axis=1))
        powers.append(power[inside][:length].reshape(-1, group).mean(axis=1))
        counts.append(np.full(length // group, group * share))
    if not rows or sum(item.size for item in rows) < _LEAST_LINES:
        return None
    return _Spectrum(np.concatenate(rows), np.concatenate(powers), np.concatenate(counts))


def _resonance(omega: FloatArray, pole: float, zeta: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the density of an acceleration under white forces, and its derivatives by ln frequency and ln damping."""
    square = omega**2
    gap = pole**2 - square
    width = 4.0 * zeta**2 * pole**2 * square
    denominator = gap**2 + width
    value = square**2 / denominator
    by_pole = -value / denominator * (4.0 * pole**2 * gap + 2.0 * width)
    by_zeta = -value / denominator * 2.0 * width
    return value, by_pole, by_zeta


class _Peak:
    """Negative log likelihood of one modal coordinate: its peak, contributions of neighbouring modes, and white noise.

    The spectrum of wind or traffic falls with frequency. A model with a flat force would attribute this slope to the
    mode and shift its frequency. The density of the force on the mode is therefore a power of the frequency near the
    peak.

    Parameters: logarithms of frequency, damping, own density and noise, the power of the frequency, logarithms of the
    densities of the neighbours.
    """

    def __init__(
        self, spectrum: _Spectrum, pole: float, others: Sequence[tuple[float, float]], exponent: float = 0.0
    ) -> None:
        self.spectrum = spectrum
        self.exponent = exponent
        self.distance = np.log(spectrum.omega / pole)
        columns = [_resonance(spectrum.omega, *pole)[0] for pole in others]
        self.others = np.array([item / item.max() for item in columns]).reshape(len(columns), spectrum.omega.size)

    def _terms(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the density at each line, shape (m,), and its derivatives by the parameters, shape (p, m)."""
        value, by_pole, by_zeta = _resonance(self.spectrum.omega, float(np.exp(theta[0])), float(np.exp(theta[1])))
        # a step of the search far outside must not overflow
        own = np.exp(np.clip(theta[2] + theta[4] * self.distance, -_LARGEST_EXPONENT, _LARGEST_EXPONENT))
        noise, rest = np.exp(theta[3]), np.exp(theta[5:])
        density = own * value + noise + rest @ self.others
        rows = [own * by_pole, own * by_zeta, own * value, np.full(density.size, noise), own * value * self.distance]
        return density, np.array([*rows, *(rest[:, None] * self.others)])

    def __call__(self, theta: FloatArray) -> tuple[float, FloatArray]:
        density, rows = self._terms(theta)
        ratio = self.spectrum.power / density
        gradient = rows @ (self.spectrum.count * (1.0 - ratio) / density)
        apart = (theta[4] - self.exponent) / _EXPONENT_SPREAD
        gradient[4] += apart / _EXPONENT_SPREAD
        prior = 0.5 * apart**2
        return float(np.sum(self.spectrum.count * (np.log(density) + ratio)) + prior), gradient

    def information(self, theta: FloatArray) -> FloatArray:
        """Return the Fisher information of all parameters."""
        density, rows = self._terms(theta)
        scaled = rows / density
        information = (self.spectrum.count * scaled) @ scaled.T
        information[4, 4] += 1.0 / _EXPONENT_SPREAD**2
        return np.asarray(information)


def _best(peak: _Peak, pole: float, starts: Sequence[float]) -> tuple[float, FloatArray]:
    """Return the least negative log likelihood, from several starts of the damping ratio, and its parameters."""
    power = peak.spectrum.power
    floor = float(np.log(max(np.quantile(power, 0.1), 1e-300)))
    best = (np.inf, np.zeros(0))
    for zeta in starts:
        top = float(np.log(max(np.quantile(power, 0.95), 1e-300) * 4.0 * zeta**2))
        theta = np.concatenate([[np.log(pole), np.log(zeta), top, floor, 0.0], np.full(len(peak.others), floor)])
        noise = (floor - _RANGE_OF_LEVELS, floor + _RANGE_OF_LEVELS)
        reach = [(theta[0] - _REACH_FREQUENCY, theta[0] + _REACH_FREQUENCY), tuple(np.log(_DAMPING_RANGE))]
        reach += [(None, None), noise, (None, None)] + [noise] * len(peak.others)
        found = minimize(peak, theta, jac=True, method="L-BFGS-B", bounds=reach, options={"maxiter": 200})
        if found.fun < best[0]:
            best = (float(found.fun), np.asarray(found.x))
    return best


def _refined(peaks: Sequence[_Peak], pole: float, starts: Sequence[float]) -> tuple[float, float, FloatArray] | None:
    """Return frequency, damping and their covariance (of logarithms), from the best of several models and starts."""
    fits = [(*_best(peak, pole, starts), peak) for peak in peaks]
    cost, theta, peak = min(fits, key=lambda item: item[0])
    if not np.isfinite(cost):
        return None
    covariance = np.asarray(np.linalg.pinv(peak.information(theta))[:2, :2], dtype=np.float64)
    return float(np.exp(theta[0])), float(np.exp(theta[1])), covariance


def two_peaks(
    tests: Sequence[FrameTest],
    poles: Sequence[tuple[float, float]],
    pole: tuple[float, float],
    known: tuple[float, float],
) -> bool:
    """Return whether the spectra have a peak at a pole in addition to that of another pole near it.

    A pole that an estimator splits from a mode adds no peak. One resonance, with free frequency and damping, is
    compared with two by their likelihoods in the power of all sensors together, each over its mean in the band (Wilks
    1938, Annals of Mathematical Statistics 9). Their sum is treated as one spectrum, because a mode moves all of them.

    Parameters
    ----------
    tests
        The ambient tests.
    poles
        All poles, each as angular frequency [rad/s] and damping ratio: the others contribute with and without a peak.
    pole, known
        The two poles.
    """
    middle, half = 0.5 * (pole[0] + known[0]), 2.0 * abs(pole[0] - known[0])
    others = [item for item in poles if item not in (pole, known) and abs(item[0] - middle) < 2.0 * half]
    sums = []
    for item in _transforms(tests, np.eye(len(tests[0].sensors))):
        inside = item.inside(middle - half, middle + half)
        if inside.any():
            power = np.abs(item.values) ** 2
            level = np.maximum(power[inside].mean(axis=0), 1e-300)
            sums.append((item.omega, np.mean(power / level, axis=1), effective_share(list(item.values[inside].T))))
    width = 2.0 * min(pole[1], known[1], _USUAL_DAMPING) * middle
    spectrum = _near(sums, middle - half, middle + half, width)
    if spectrum is None:
        return False
    one, two = np.inf, np.inf
    for first, second in ((pole, known), (known, pole)):
        starts = (first[1], abs(pole[0] - known[0]) / middle)
        one = min(one, _best(_Peak(spectrum, first[0], others), first[0], starts)[0])
        two = min(two, _best(_Peak(spectrum, first[0], [second, *others]), first[0], starts)[0])
    # a second peak has three parameters
    return bool(stats.chi2.sf(2.0 * (one - two), 3) < _FALSE_PEAK)


def _half_width(mode: int, modes: Sequence[tuple[float, float]]) -> float:
    """Return half the width of the band around a mode in which its spectrum is fitted [rad/s].

    The flanks of a peak separate its damping from noise and from the level of the force. The band therefore reaches
    half way to the next mode, as far as a power of the frequency can describe the force.
    """
    pole, damping = modes[mode]
    gap = min((abs(other - pole) for i, (other, _) in enumerate(modes) if i != mode), default=np.inf)
    least = max(_WIDTHS * max(damping, _USUAL_DAMPING), _LEAST_HALF_WIDTH)
    return max(least * pole, min(0.5 * gap, _LARGEST_HALF_WIDTH * pole))


def _share(lines: _Lines, modes: Sequence[tuple[float, float]]) -> float:
    """Return the share of a test that counts, from the motion of all modes in their bands."""
    bands = [(pole, _half_width(mode, modes)) for mode, (pole, _) in enumerate(modes)]
    return effective_share([
        lines.values[lines.inside(pole - half, pole + half), mode] for mode, (pole, half) in enumerate(bands)
    ])  # fmt: skip


def refine_by_spectra(fit: MultiModeFit, tests: Sequence[FrameTest]) -> MultiModeFit:
    """Return a fit with frequencies, damping ratios and their covariance by maximum likelihood.

    A mode whose peak has too few lines, or whose estimate ends at a bound, keeps its values.

    Parameters
    ----------
    fit
        Modes of ambient tests, with shapes at the sensors.
    tests
        The ambient tests, with the sensors of the fit.
    """
    omega, zeta = fit.angular_frequencies.copy(), fit.damping_ratios.copy()
    covariance = fit.covariance.copy()
    modes = omega.size
    before = list(zip(omega.tolist(), zeta.tolist(), strict=True))
    transforms = _transforms(tests, fit.residues.real)
    shares = [_share(item, before) for item in transforms]
    moving = False
    exponents = (0.0, _SUPPORT_EXPONENT, _SOIL_EXPONENT) if min(shares) < 1.0 else (0.0,)
    for turn in range(_MOST_ROUNDS):
        if turn >= _ROUNDS and not moving:
            break
        moving = False
        before = list(zip(omega.copy(), zeta.copy(), strict=True))
        for mode, (pole, damping) in enumerate(before):
            half = _half_width(mode, before)
            width = 2.0 * min(damping, _USUAL_DAMPING) * pole
            powers = [
                (item.omega, np.abs(item.values[:, mode]) ** 2, share)
                for item, share in zip(transforms, shares, strict=True)
            ]
            spectrum = _near(powers, pole - half, pole + half, width)
            if spectrum is None:
                continue
            others = [item for i, item in enumerate(before) if i != mode and abs(item[0] - pole) < 2.0 * half]
            peaks = [_Peak(spectrum, pole, others, exponent) for exponent in exponents]
            found = _refined(peaks, pole, (damping, _USUAL_DAMPING))
            if found is None or not _DAMPING_RANGE[0] * 1.01 < found[1] < _DAMPING_RANGE[1] * 0.99:
                continue
            # an estimate at the end of the search is not yet at its peak
            moving = moving or abs(np.log(found[0] / pole)) > 0.99 * _REACH_FREQUENCY
            omega[mode], zeta[mode] = found[0], found[1]
            own = np.array([mode, modes + mode])
            covariance[own, :] = 0.0
            covariance[:, own] = 0.0
            covariance[np.ix_(own, own)] = found[2]
    return replace(fit, angular_frequencies=omega, damping_ratios=zeta, covariance=covariance)
