"""Damping from free decays: logarithmic decrement, exponential fit, peak to peak (section 3.2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import signal, stats
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray
from mrpipe.modal.records import FrameTest

HALF_BAND_RAD_S = np.pi
FILTER_ORDER = 5
_DRIVEN = 0.5
"""A mode is still driven when the excitation stops if its amplitude is above this share of the largest one."""
LARGEST_FILTERED_DAMPING = 0.02
"""Largest damping ratio with the band-pass; beyond it the band-pass rings longer than the mode."""
_NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float

    @staticmethod
    def of(value: float, standard_error: float) -> Estimate:
        """Return value +- 1.96 standard errors."""
        return Estimate(value, value - _NORMAL_95 * standard_error, value + _NORMAL_95 * standard_error)

    @staticmethod
    def of_logarithm(value: float, standard_error: float, freedom: float = np.inf) -> Estimate:
        """Return the interval of a positive value from the standard error of its logarithm.

        The quantile is that of Student's t with `freedom` degrees of freedom, because a standard error from a few
        groups is itself uncertain.
        """
        # a very large standard error gives an interval from zero to infinity
        with np.errstate(over="ignore"):
            factor = float(np.exp(stats.t.ppf(0.975, freedom) * standard_error))
        return Estimate(value, value / factor, value * factor)

    @property
    def half_width(self) -> float:
        """Half of the interval's width."""
        return 0.5 * (self.high - self.low)

    def as_dict(self) -> dict[str, float]:
        """Return plain numbers."""
        return {"value": float(self.value), "low": float(self.low), "high": float(self.high)}


DecayMethod = Literal["exponential-fit", "logarithmic-decrement", "point-to-point", "linear-fit"]
"""Methods to compute the damping ratio from a decay."""


@dataclass(frozen=True)
class DecayResult:
    """Result of one decay test for its mode.

    Attributes
    ----------
    test, mode
        Name of the test, and the mode (from 1).
    logarithmic_decrement, exponential_fit, point_to_point
        Damping ratio [1] by each method.
    angular_frequency
        Angular frequency of the exponential fit [rad/s].
    peak_time_s, peak
        Peaks of the band-passed modal coordinate in its decay, shape (k,); [s], [m/s2].
    point_to_point_series
        Damping ratio from each peak to the next of the same sign, shape (k - 2,) [1].
    time_s, coordinate, fitted
        Modal coordinate over the decay and the exponential fit, shape (m,).
    filtered
        Whether the band-pass was used (damping up to 0.02).
    """

    test: str
    mode: int
    logarithmic_decrement: Estimate
    exponential_fit: Estimate
    point_to_point: Estimate
    angular_frequency: float
    peak_time_s: FloatArray
    peak: FloatArray
    point_to_point_series: FloatArray
    time_s: FloatArray
    coordinate: FloatArray
    fitted: FloatArray
    filtered: bool

    def damping_ratio(self, method: DecayMethod) -> Estimate:
        """Return the damping ratio by one of the methods."""
        if method == "linear-fit":
            return linear_envelope(self.peak_time_s, self.peak).estimate
        readings = {
            "exponential-fit": self.exponential_fit,
            "logarithmic-decrement": self.logarithmic_decrement,
            "point-to-point": self.point_to_point,
        }
        return readings[method]


@dataclass(frozen=True)
class Envelope:
    """A curve through the peaks of a decay (Figure 3.10a).

    Attributes
    ----------
    damping_ratio
        Damping ratio from the decay rate of the curve at its start [1].
    standard_error
        Standard error of the damping ratio, from the scatter of the peaks around the curve.
    rms_error
        RMS error of the peaks, in their unit.
    """

    damping_ratio: float
    standard_error: float
    rms_error: float

    @property
    def estimate(self) -> Estimate:
        """The damping ratio with its interval."""
        return Estimate.of(self.damping_ratio, self.standard_error)


def linear_envelope(peak_time_s: FloatArray, peak: FloatArray) -> Envelope:
    """Fit a straight line to the peaks of a decay (section 3.2.2).

    The damping ratio follows from the slope of the line over its value at the first peak, which is the decay rate of
    the exponential that is tangent there.

    Parameters
    ----------
    peak_time_s
        Times of the peaks of both signs, two in a period, shape (k,) [s].
    peak
        Heights of the peaks, positive, shape (k,).
    """
    clock = peak_time_s - peak_time_s[0]
    (slope, level), covariance = np.polyfit(clock, peak, 1, cov=True)
    period = 2.0 * float(np.mean(np.diff(peak_time_s)))
    error = peak - (level + slope * clock)
    ratio = damping_from_decrement(-slope / level * period)
    relative = float(np.sqrt(covariance[0, 0])) / abs(slope)
    return Envelope(ratio, abs(ratio) * relative, float(np.sqrt(np.mean(error**2))))


def logarithmic_envelope(peak_time_s: FloatArray, peak: FloatArray) -> Envelope:
    """Fit an exponential to the peaks of a decay by a straight line through their logarithms; arguments as above."""
    clock = peak_time_s - peak_time_s[0]
    (slope, level), covariance = np.polyfit(clock, np.log(peak), 1, w=peak, cov=True)
    period = 2.0 * float(np.mean(np.diff(peak_time_s)))
    error = peak - np.exp(level + slope * clock)
    ratio = damping_from_decrement(-slope * period)
    relative = float(np.sqrt(covariance[0, 0])) / abs(slope)
    return Envelope(ratio, abs(ratio) * relative, float(np.sqrt(np.mean(error**2))))


def damping_from_decrement(decrement: float) -> float:
    """Return the damping ratio of a logarithmic decrement over one period (3.1)."""
    return float(decrement / np.sqrt(4.0 * np.pi**2 + decrement**2))


def modal_coordinates(test: FrameTest, mode_shapes: FloatArray, angular_frequencies: FloatArray) -> FloatArray:
    """Return the relative accelerations of the modes, shape (m, r): the inverse of the mode matrix separates them.

    For a floor with only a displacement the acceleration is -omega^2 times the displacement, with omega of the mode.
    """
    responses = test.responses - test.responses.mean(axis=0)
    inverse = np.linalg.pinv(mode_shapes)
    flags = np.asarray(test.is_displacement)
    relative = responses.copy()
    if test.excitation is not None and test.shaker_floor == 0:
        relative[:, ~flags] -= (test.excitation - test.excitation.mean())[:, None]
    result = np.empty((relative.shape[0], angular_frequencies.size))
    for index, omega in enumerate(angular_frequencies):
        factor = np.where(flags, -(omega**2), 1.0)
        result[:, index] = (relative * factor) @ inverse[index]
    return result


def decay_start(test: FrameTest, coordinate: FloatArray, omega: float) -> int:
    """Return the sample at which the free decay begins; 0 if the record begins with the release.

    The decay begins where the excitation near the frequency of the mode stops. At a resonance a small excitation below
    the noise of its sensor may be sufficient to drive the mode. A decay never begins before the largest amplitude, so
    this is used as well. An excitation that continues while the amplitude has fallen is noise of the sensor.
    """
    rate = test.sampling_rate_hz
    envelope = np.abs(signal.hilbert(_band_pass(coordinate, omega, rate)))
    largest = int(np.argmax(envelope))
    # the amplitude of a decay that begins with the record is largest at its beginning, except for filter ringing
    largest = 0 if largest < _edge_s(2.0 * np.pi / omega, coordinate.size / rate, True) * rate else largest
    if test.excitation is None:
        return largest
    width = max(3, round(max(2.0, 8.0 * np.pi / omega) * rate))
    near = _band_pass(test.excitation - np.median(test.excitation), omega, rate)
    power = np.convolve(near**2, np.full(width, 1.0 / width), mode="same")
    quiet, top = float(np.quantile(power, 0.05)), float(power.max())
    if top <= 9.0 * quiet:  # also where the channel of the excitation is zero
        return largest
    # filter and average are symmetric, so the power falls through its half where the excitation stops
    stop = int(np.flatnonzero(power > 0.5 * (quiet + top))[-1]) + 1
    period = max(1, round(2.0 * np.pi / omega * rate))
    at_stop = float(envelope[max(0, stop - period) : stop + period].max())
    return max(largest, stop) if at_stop > _DRIVEN * float(envelope.max()) else largest


def _band_pass(coordinate: FloatArray, omega: float, rate: float) -> FloatArray:
    low = max(omega - HALF_BAND_RAD_S, 0.2 * omega)
    edges = np.array([low, omega + HALF_BAND_RAD_S]) / (2.0 * np.pi)
    sections = signal.butter(FILTER_ORDER, edges, btype="bandpass", fs=rate, output="sos")
    return np.asarray(signal.sosfiltfilt(sections, coordinate))


def _edge_s(period: float, duration: float, filtered: bool) -> float:
    """Return the time [s] after the stop, and before the end, in which the band-pass still rings.

    The slowest pole of the Butterworth band-pass decays with half the bandwidth times sin(pi/2/order).
    """
    if not filtered:
        return period
    slowest = HALF_BAND_RAD_S * np.sin(0.5 * np.pi / FILTER_ORDER)
    return float(min(max(period, 4.0 / slowest), 0.2 * duration))


def _peaks(values: FloatArray, rate: float, omega: float) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and heights of the extrema of either sign, refined by a parabola."""
    magnitude = np.abs(values)
    distance = max(1, int(0.6 * np.pi / omega * rate))
    index = signal.find_peaks(magnitude, distance=distance)[0]
    index = index[(index > 0) & (index < magnitude.size - 1)]
    left, centre, right = magnitude[index - 1], magnitude[index], magnitude[index + 1]
    curvature = left - 2.0 * centre + right
    shift = np.where(curvature < 0.0, 0.5 * (left - right) / np.where(curvature < 0.0, curvature, -1.0), 0.0)
    return (index + shift) / rate, centre - 0.25 * (left - right) * shift


def _useful(peak: FloatArray, noise: float) -> int:
    """Number of leading peaks down to a fifth of the first and well above the noise (at most six)."""
    above = peak > max(0.2 * peak[: min(4, peak.size)].max(), 8.0 * noise)
    below = np.flatnonzero(~above)
    return int(max(below[0] if below.size else peak.size, min(6, peak.size)))


def _decrement(time: FloatArray, peak: FloatArray) -> tuple[Estimate, Estimate, FloatArray]:
    """Return the damping ratio from the decrement over all peaks, the mean from peak to peak, and the series."""
    logs = np.log(peak)
    slope, intercept = np.polyfit(time, logs, 1, w=peak)
    scatter = logs - (slope * time + intercept)
    # neighbouring peaks of a filtered signal have nearly the same noise: one of four counts
    spread = float(np.sqrt(np.average(scatter**2, weights=peak**2)) * 2.0)
    cycles = 0.5 * (peak.size - 1)
    count = max(1, peak.size // 8)
    first, last = logs[:count].mean(), logs[-count:].mean()
    decrement = (first - last) / (0.5 * (peak.size - count))
    zeta = damping_from_decrement(decrement)
    error = spread * np.sqrt(2.0 / count) / cycles / (2.0 * np.pi)
    series = np.array([damping_from_decrement(d) for d in logs[:-2] - logs[2:]])
    weights = peak[:-2] ** 2
    mean = float(np.average(series, weights=weights))
    mean_error = float(np.sqrt(np.average((series - mean) ** 2, weights=weights) / max(series.size / 4.0, 1.0)))
    return Estimate.of(zeta, float(error)), Estimate.of(mean, mean_error), series


def _waves(time: FloatArray, poles: list[complex]) -> FloatArray:
    columns = [np.ones_like(time)]
    for pole in poles:
        wave = np.exp(pole * time)
        columns += [wave.real, wave.imag]
    return np.column_stack(columns)


def damped_sinusoids(time: FloatArray, angular_frequencies: FloatArray, damping_ratios: FloatArray) -> FloatArray:
    """Return a constant, and for each mode the real and imaginary part of its decaying wave, shape (m, 1 + 2r)."""
    zetas, omegas = damping_ratios, angular_frequencies
    poles = -zetas * omegas + 1j * omegas * np.sqrt(1.0 - zetas**2)
    return _waves(time, [complex(pole) for pole in poles])


def exponential_fit(
    time: FloatArray, coordinate: FloatArray, mode: int, omegas: FloatArray, zetas: FloatArray
) -> tuple[float, Estimate, FloatArray]:
    """Fit damped sinusoids of all modes, this mode's pole free: frequency [rad/s], damping, fitted curve."""
    poles = -zetas * omegas + 1j * omegas * np.sqrt(1.0 - zetas**2)
    others = [complex(pole) for index, pole in enumerate(poles) if index != mode]

    def solve(theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        omega, zeta = np.exp(theta)
        own = complex(-zeta * omega, omega * np.sqrt(max(1 - zeta**2, 1e-12)))
        basis = _waves(time, [own, *others])
        fitted = basis @ np.linalg.lstsq(basis, coordinate, rcond=None)[0]
        return coordinate - fitted, fitted

    start = np.log([omegas[mode], np.clip(zetas[mode], 1e-5, 0.3)])
    bounds = ([start[0] - 0.1, np.log(1e-6)], [start[0] + 0.1, np.log(0.6)])
    scale = float(np.std(coordinate)) or 1.0
    result = least_squares(
        lambda t: solve(t)[0] / scale, start, bounds=bounds, x_scale="jac", diff_step=1e-5, xtol=1e-10
    )
    omega, zeta = np.exp(result.x)
    inverse = np.linalg.pinv(result.jac.T @ result.jac)
    block = max(2, round(2.0 * np.pi / omega / float(time[1] - time[0])))
    usable = block * (time.size // block)
    scores = (result.jac * result.fun[:, None])[:usable].reshape(-1, block, 2).sum(axis=1)
    error = float(np.sqrt((inverse @ (scores.T @ scores) @ inverse)[1, 1])) * zeta
    return float(omega), Estimate.of(float(zeta), error), solve(result.x)[1]


def analyse_decay(
    test: FrameTest, mode_shapes: FloatArray, angular_frequencies: FloatArray, damping_ratios: FloatArray
) -> DecayResult | None:
    """Return the damping that a decay test shows, or None if no decay exceeds the noise.

    Parameters
    ----------
    test
        A free-decay test; the part after the last excitation is used.
    mode_shapes
        Shape (n, r), real.
    angular_frequencies, damping_ratios
        Values of all modes from the forced tests, shape (r,), from which the fit starts.
    """
    rate = test.sampling_rate_hz
    coordinates = modal_coordinates(test, mode_shapes, angular_frequencies)
    sizes = np.linalg.norm(mode_shapes, axis=0) * coordinates.std(axis=0)
    mode = test.mode - 1 if 1 <= test.mode <= angular_frequencies.size else int(np.argmax(sizes))
    start = decay_start(test, coordinates[:, mode], float(angular_frequencies[mode]))
    tail = coordinates[start:]
    omega, zeta = float(angular_frequencies[mode]), float(damping_ratios[mode])
    period = 2.0 * np.pi / omega
    if tail.shape[0] / rate < 6.0 * period:
        return None
    own = coordinates[:, mode] - tail[:, mode].mean()
    high = own[start:] - signal.savgol_filter(own[start:], 2 * max(2, int(0.05 * period * rate)) + 1, 3)
    # a short decay ends while the band-pass still rings from the release: its peaks are then taken without filter
    for filtered in (True, False) if zeta <= LARGEST_FILTERED_DAMPING else (False,):
        shown = _band_pass(own, omega, rate) if filtered else own
        edge = int(_edge_s(period, tail.shape[0] / rate, filtered) * rate)
        first, last = start + edge, own.size - (edge if filtered else 0)
        time, peak = _peaks(shown[first:last], rate, omega)
        share = min(1.0, 2.0 * HALF_BAND_RAD_S / (np.pi * rate)) if filtered else 1.0
        noise = float(np.std(high)) * np.sqrt(share)
        if peak.size >= 6 and peak[0] >= 5.0 * noise:
            break
    else:
        return None
    keep = _useful(peak, noise)
    time, peak = time[:keep], peak[:keep]
    decrement, mean, series = _decrement(time, peak)
    step = max(1, int(rate * 2.0 * np.pi / float(angular_frequencies.max()) / 24.0))
    begin, end = start + int(0.25 * period * rate), min(own.size, first + int((time[-1] + period) * rate))
    piece = (
        signal.sosfiltfilt(signal.butter(4, 0.8 / step, output="sos"), own)[begin:end:step]
        if step > 1
        else own[begin:end]
    )
    clock = np.arange(piece.size) * step / rate
    fitted_omega, exponential, fitted = exponential_fit(clock, piece, mode, angular_frequencies, damping_ratios)
    return DecayResult(
        test=test.name,
        mode=mode + 1,
        logarithmic_decrement=decrement,
        exponential_fit=exponential,
        point_to_point=mean,
        angular_frequency=fitted_omega,
        peak_time_s=time + first / rate,
        peak=peak,
        point_to_point_series=series,
        time_s=clock + begin / rate,
        coordinate=piece,
        fitted=fitted,
        filtered=filtered,
    )
