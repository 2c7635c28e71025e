"""Clocks of the sensors of ambient tests, from the coherency of their responses.

A proportionally damped structure has real mode shapes, so that the cross-spectrum of two sensors is real at each
resonance. Where the clock of sensor j is late by tau_j, its phase is -omega (tau_j - tau_l). One delay for each sensor
therefore makes all cross-spectra real at once. A delay, constant or changing linearly with time, counts only if it
predicts the phases in parts of the band that were left out of its estimate. A delay that all sensors share has no
effect and cannot be determined; delays are therefore relative to the median of the sensors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal, stats
from scipy.optimize import minimize

from mrpipe.artifacts import FloatArray
from mrpipe.modal.ambient.band import USABLE_BAND, coherency, common_motion_ends_hz, lowest_peak_hz
from mrpipe.modal.clocks.delays import LEAST_PHASE, SensorClock, corrected
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import ComplexArray

_CHUNKS = 8
"""Number of parts of the record, from which a drift is estimated."""
_SEGMENTS = 8
"""Number of segments of a part, from which the coherency is estimated."""
_FORCED_SEGMENTS = 4
"""The same for forced tests: a sweep excites a line in few segments, and long segments have more lines."""
_BANDS = 10
"""Number of parts of the band with equal coherency; each is left out once."""
_LEVEL = 0.01
"""Probability that a delay is found where there is none."""
_GRID_PHASE = 0.5
"""Step of the scan over delays: phase of the highest frequency [rad]."""
_LARGEST_DRIFT = 1e-4
"""Largest drift [1]: quartz clocks differ by less than 100 parts per million."""


@dataclass(frozen=True)
class _Coherency:
    """Squared complex coherency of each pair of sensors: its angle is twice the phase of the cross-spectrum.

    Attributes
    ----------
    omega
        Shape (m,) [rad/s].
    squared
        Shape (chunks, pairs, m).
    first, second
        Sensors of each pair, shape (pairs,).
    time
        Middle of each chunk, from the middle of the record [s], shape (chunks,).
    """

    omega: FloatArray
    squared: ComplexArray
    first: np.ndarray
    second: np.ndarray
    time: FloatArray

    def real_part(self, offset: FloatArray, drift: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the real part at given delays of the sensors, summed over pairs, shape (chunks, m), and its slope.

        The slope is the derivative with respect to the delay of the first sensor of each pair, shape (chunks, pairs).
        """
        delay = offset[None, :] + self.time[:, None] * drift
        apart = delay[:, self.first] - delay[:, self.second]
        turned = self.squared * np.exp(2j * self.omega * apart[:, :, None])
        return turned.real.sum(axis=1), -2.0 * (turned.imag @ self.omega)


def _coherency(test: FrameTest, low_hz: float, high_hz: float, *, stationary: bool = True) -> _Coherency:
    rate, (samples, sensors) = test.sampling_rate_hz, test.responses.shape
    length, segments = samples // _CHUNKS, _SEGMENTS if stationary else _FORCED_SEGMENTS
    first, second = np.triu_indices(sensors, 1)
    squared, powers = [], []
    for chunk in range(_CHUNKS):
        values = test.responses[chunk * length : (chunk + 1) * length]
        frequency, _, parts = signal.stft(
            values - values.mean(axis=0), fs=rate, nperseg=max(16, length // segments), axis=0, boundary=None
        )
        inside = (frequency >= low_hz) & (frequency <= high_hz)
        found = coherency(parts[inside])
        if not stationary:
            # where a sweep is at another frequency, a line contains only leakage, whose phase has no meaning
            own = np.mean(np.abs(parts[inside]) ** 2, axis=2)
            powers.append(own)
            found = found * np.sqrt(own[:, :, None] * own[:, None, :])
        squared.append((found[:, first, second] ** 2).T)
    if not stationary:
        power = np.mean(powers, axis=0)
        squared = [item / np.maximum(power[:, first] * power[:, second], 1e-300).T for item in squared]
    time = (np.arange(_CHUNKS) + 0.5) * length / rate - 0.5 * samples / rate
    return _Coherency(2.0 * np.pi * frequency[inside], np.array(squared), first, second, time)


def _pair_delays(found: _Coherency, reach: float, drift_reach: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return offset, drift and certainty of the delay between the sensors of each pair, shape (pairs,) each."""
    step = _GRID_PHASE / float(found.omega[-1])
    half_time = float(found.time[-1])
    drift_steps = int(np.ceil(drift_reach * half_time / step))
    steps = int(np.ceil(reach / step))
    places = np.arange(-steps - drift_steps, steps + drift_steps + 1)
    turn = np.exp(2j * np.outer(found.omega, places * step))
    value = np.real(found.squared @ turn)
    kept = np.arange(drift_steps, drift_steps + 2 * steps + 1)
    tables = []
    for slope in range(-drift_steps, drift_steps + 1):
        shift = np.rint(slope * found.time / half_time).astype(np.int64)
        tables.append(sum(value[chunk][:, kept + shift[chunk]] for chunk in range(found.time.size)))
    table = np.array(tables)
    offsets, drifts, certain = [], [], []
    weight = np.abs(found.squared).sum(axis=(0, 2))
    for pair in range(table.shape[1]):
        best, place = np.unravel_index(int(np.argmax(table[:, pair])), table[:, pair].shape)
        offsets.append((int(place) - steps) * step)
        drifts.append((int(best) - drift_steps) * step / half_time)
        certain.append(float(table[best, pair, place]) / max(float(weight[pair]), 1e-300))
    return np.array(offsets), np.array(drifts), np.array(certain) * weight


def _start(found: _Coherency, sensors: int, reach: float, drift_reach: float) -> tuple[FloatArray, FloatArray]:
    """Return offsets and drifts of the sensors from the most certain pairs (a spanning tree)."""
    offsets, drifts, certain = _pair_delays(found, reach, drift_reach)
    offset, drift = np.zeros(sensors), np.zeros(sensors)
    known = {int(found.first[int(np.argmax(certain))])}
    while len(known) < sensors:
        open_pairs = [i for i in range(certain.size) if (found.first[i] in known) != (found.second[i] in known)]
        best = max(open_pairs, key=lambda i: certain[i])
        one, two = int(found.first[best]), int(found.second[best])
        if one in known:
            offset[two], drift[two] = offset[one] - offsets[best], drift[one] - drifts[best]
        else:
            offset[one], drift[one] = offset[two] + offsets[best], drift[two] + drifts[best]
        known |= {one, two}
    return offset, drift


def _polished(
    found: _Coherency, offset: FloatArray, drift: FloatArray, *, drifts: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the offsets and drifts at the nearest maximum; without `drifts` the drifts are not changed."""
    sensors, unit = offset.size, 1.0 / float(found.omega[-1])
    half_time = float(found.time[-1])

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        slope = theta[sensors:] * unit / half_time if drifts else drift
        value, by_pair = found.real_part(theta[:sensors] * unit, slope)
        by_sensor = np.zeros((found.time.size, sensors))
        np.add.at(by_sensor.T, found.first, by_pair.T)
        np.add.at(by_sensor.T, found.second, -by_pair.T)
        gradient = [by_sensor.sum(axis=0) * unit]
        if drifts:
            gradient.append(found.time @ by_sensor * unit / half_time)
        return -float(value.sum()), -np.concatenate(gradient)

    start = np.concatenate([offset / unit, drift * half_time / unit] if drifts else [offset / unit])
    best = minimize(cost, start, jac=True, method="L-BFGS-B", options={"maxiter": 100}).x
    return best[:sensors] * unit, (best[sensors:] * unit / half_time if drifts else drift)


def _bands(found: _Coherency) -> list[np.ndarray]:
    """Return the lines of parts of the band with equal sums of coherency, beyond that of noise by chance."""
    by_chance = 1.0 / _SEGMENTS  # expectation of the squared coherency of independent noise
    weight = np.cumsum(np.maximum(np.abs(found.squared).mean(axis=(0, 1)) - by_chance, 0.0))
    edges = np.searchsorted(weight, weight[-1] * np.arange(1, _BANDS) / _BANDS)
    return [part for part in np.split(np.arange(found.omega.size), edges) if part.size]


def _gain(
    found: _Coherency, band: np.ndarray, one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]
) -> float:
    """Return the increase of the real part in a band from one set of delays to another one."""
    return float((found.real_part(*one)[0] - found.real_part(*other)[0])[:, band].sum())


def _proven(gains: FloatArray) -> bool:
    """Return whether gains in bands that were left out are positive.

    The gain of a delay grows with frequency and with the response. Ranks (Wilcoxon 1945) need no equal variances.
    """
    return bool(stats.wilcoxon(gains, alternative="greater", method="exact").pvalue < _LEVEL)


def _left_out(found: _Coherency, band: np.ndarray) -> _Coherency:
    keep = np.setdiff1d(np.arange(found.omega.size), band)
    return _Coherency(found.omega[keep], found.squared[:, :, keep], found.first, found.second, found.time)


def reach_s(test: FrameTest) -> float:
    """Return the largest delay [s] that the coherency of a forced test determines without ambiguity.

    Lines of segments of length T are 1/T apart, and the phase of the squared coherency is twice that of the delay.
    """
    length = test.responses.shape[0] // _CHUNKS // _FORCED_SEGMENTS
    return float(0.25 * length / test.sampling_rate_hz)


def ambient_clocks(
    test: FrameTest, low_hz: float, high_hz: float = 0.0, *, longest_s: float | None = None
) -> list[SensorClock]:
    """Return the delays of the sensors of a test, as far as its responses confirm them.

    Parameters
    ----------
    test
        An ambient test, or a forced one, whose excitation is then not used.
    low_hz, high_hz
        Band [Hz]; 0 for `high_hz`: the band in which the motions of the sensors are coherent.
    longest_s
        Largest delay between two sensors [s]; half a period of the lowest mode if left out.
    """
    sensors = len(test.sensors)
    if sensors < 2:
        return []
    first = lowest_peak_hz([test], low_hz)
    high = high_hz or min(USABLE_BAND * test.sampling_rate_hz, common_motion_ends_hz(test, first))
    found = _coherency(test, max(low_hz, 0.5 * first), high, stationary=test.kind == "ambient")
    bands = _bands(found)
    if len(bands) < _BANDS:
        return []
    # a delay of more than half a period of the lowest mode would change the sign of its shape
    reach = 0.5 / first if longest_s is None else longest_s
    still = np.zeros(sensors)

    def estimate(data: _Coherency, drifts: bool) -> tuple[FloatArray, FloatArray]:
        return _polished(data, *_start(data, sensors, reach, _LARGEST_DRIFT if drifts else 0.0), drifts=drifts)

    # the search over all delays is repeated without each band, so that its result does not depend on that band
    parts = [_left_out(found, band) for band in bands]
    none = (still, still)

    def gain(
        ones: Sequence[tuple[FloatArray, FloatArray]], others: Sequence[tuple[FloatArray, FloatArray]]
    ) -> FloatArray:
        return np.array([_gain(found, *parts) for parts in zip(bands, ones, others, strict=True)])

    best, left_out = none, [none] * len(bands)
    for drifts in (False, True):
        of_parts = [estimate(part, drifts) for part in parts]
        if _proven(gain(of_parts, left_out)):
            best, left_out = estimate(found, drifts), of_parts
    return _stated(test, best, left_out, float(found.time[-1]), 1.0 / float(found.omega[-1]))


def _stated(
    test: FrameTest,
    best: tuple[FloatArray, FloatArray],
    left_out: Sequence[tuple[FloatArray, FloatArray]],
    half_time: float,
    unit: float,
) -> list[SensorClock]:
    """Return the delays relative to the median of the sensors; delays below the smallest phase are left out."""
    offset, drift = best[0] - np.median(best[0]), best[1] - np.median(best[1])
    scatter = np.array([item[0] - np.median(item[0]) for item in left_out])
    count = len(left_out)
    errors = np.sqrt((count - 1) * scatter.var(axis=0))
    start = offset - drift * 0.5 * test.duration_s
    return [
        SensorClock(test.name, sensor, float(start[i]), float(errors[i]), float(drift[i]))
        for i, sensor in enumerate(test.sensors)
        if abs(offset[i]) + abs(drift[i]) * half_time > LEAST_PHASE * unit
    ]


def synchronised(
    tests: Sequence[FrameTest], band_hz: tuple[float, float], options: IdentificationOptions
) -> tuple[tuple[FrameTest, ...], tuple[SensorClock, ...]]:
    """Return ambient tests with corrected clocks of their sensors, and the delays that were corrected.

    Parameters
    ----------
    tests
        Ambient tests.
    band_hz
        As in :func:`ambient_clocks`.
    options
        Whether clocks are corrected.
    """
    if not options.clock_correction:
        return tuple(tests), ()
    clocks = [clock for test in tests for clock in ambient_clocks(test, *band_hz)]
    return tuple(corrected(test, clocks) for test in tests), tuple(clocks)
