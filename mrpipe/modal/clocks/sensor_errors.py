"""Removal of sensor errors from spectra, if clocks drift: cross-talk, and remaining errors of the corrected clocks.

A sensor shows a small share of the motion of the other sensors (cables, housings, amplifiers). If all sensors have the
same clock, this share only changes the mode shapes a little. If the clocks run differently, the correction of the clock
of a sensor makes the phase of the shares of the others drift: their resonances are smeared over neighbouring lines.
A drift or a step of a clock that was estimated wrongly has the same effect. Near a strong mode this is more than the
noise, and it changes the damping ratio of a hidden mode there.

Both are estimated by linear regression. After correction of the clocks, sensor i contains a share of the fitted
response y_j of sensor j at the time t + d_i(t) - d_j(t), where d are the delays, and the fitted derivative of y_i times
the remaining error of its delay, a polynomial of time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.modal.clocks.delays import SensorClock
from mrpipe.modal.clocks.interpolation import Interpolation, between_samples
from mrpipe.modal.fit.projected import ProjectedFit
from mrpipe.modal.fit.projection import Problem, stack
from mrpipe.modal.records import FrameTest, Sensor
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum, record_spectrum

_LEAST_TURN = 0.1
"""Least change of the phase between two clocks over a test, at the highest mode [rad]. If it is less, the share of the
other sensor cannot be distinguished from the response, and does not disturb the poles."""
_LARGEST_SHARE = 0.1
"""Largest cross-talk that is credible. Larger coefficients describe another error of the model."""
_LARGEST_PHASE = 0.5
"""Largest rest of a delay, as phase at the highest mode [rad], for which its effect is linear."""
_POWERS = 3
"""Degree of the rest of a delay that changes with time. A constant rest is a part of the residues."""


class SensorErrors:
    """Cross-talk and rests of the clocks of tests, estimated from a fit with separate residues of each test.

    Parameters
    ----------
    tests
        Tests in the order of the spectra of the fits, clocks corrected.
    clocks
        The delays that were corrected.
    """

    def __init__(self, tests: Sequence[FrameTest], clocks: Sequence[SensorClock]) -> None:
        self.tests = tuple(tests)
        self.clocks = tuple(clocks)

    def removed(
        self, fit: ProjectedFit, theta: FloatArray, spectra: Sequence[RecordSpectrum]
    ) -> tuple[RecordSpectrum, ...]:
        """Return `spectra` without those errors of the sensors that the residual of the fit supports.

        Parameters
        ----------
        fit
            A fit of `spectra` in which each group of sensors belongs to one test.
        theta
            Its poles (ln omega, ln zeta).
        spectra
            Spectra of the tests.
        """
        if any(len(group.tests) > 1 for group in fit.groups):
            raise ValueError("errors of sensors are estimated with separate residues of each test")
        shares = [np.zeros_like(item.responses) for item in spectra]
        for index, test in enumerate(self.tests):
            delays = self._delays(test)
            highest = float(np.exp(theta[: theta.size // 2]).max())
            turns = _turns(delays, highest)
            if turns.max(initial=0.0) < _LEAST_TURN:
                continue
            histories = self._responses(fit, theta, index, (spectra[index].omega[0], spectra[index].omega[-1]))
            bases = _bases(fit, theta, index)
            for row, sensor in enumerate(test.sensors):
                alike = [item == test.is_displacement[row] for item in test.is_displacement]
                others = [j for j, same in enumerate(alike) if same and turns[row, j] >= _LEAST_TURN]
                columns = [_at(histories[j], delays[row] - delays[j], test.sampling_rate_hz)[0] for j in others]
                limits = [_LARGEST_SHARE] * len(others)
                if np.ptp(delays[row]) > 0.0:
                    columns += _late(histories[row], test, highest)
                    limits += [_LARGEST_PHASE] * _POWERS
                found = _supported(_spectra(columns, spectra[index]), np.array(limits), *bases[sensor])
                shares[index][:, spectra[index].sensors.index(sensor)] = found
        return tuple(
            replace(item, responses=item.responses - share) for item, share in zip(spectra, shares, strict=True)
        )

    def _delays(self, test: FrameTest) -> FloatArray:
        """Return the delay of each sensor over the time of the test [s], shape (sensors, samples)."""
        time = np.arange(test.responses.shape[0]) / test.sampling_rate_hz
        known = {item.sensor: item for item in self.clocks if item.test == test.name}
        zero = np.zeros(time.size)
        return np.array([known[item].delay(time) if item in known else zero for item in test.sensors])

    def _responses(
        self, fit: ProjectedFit, theta: FloatArray, index: int, band_rad_s: tuple[float, float]
    ) -> list[Interpolation]:
        """Return the fitted response of the modes at each sensor of a test as a function of time."""
        test, modes = self.tests[index], theta.size // 2
        low, high = np.array(band_rad_s) / (2.0 * np.pi)
        whole = record_spectrum(test, (float(low) * (1.0 - 1e-9), float(high) * (1.0 + 1e-9)))
        samples = test.responses.shape[0]
        lines = _lines(whole, samples)
        found: dict[Sensor, FloatArray] = {}
        for group, state in zip(fit.groups, fit.states(theta), strict=True):
            if group.tests != [index]:
                continue
            own = group.problem
            problem = Problem([whole], modes, own.displacement, own.inputs)
            response = np.zeros((whole.omega.size, len(group.sensors)), dtype=np.complex128)
            for mode in range(modes):
                part = state.coefficients[mode * own.width : (mode + 1) * own.width] * group.sigma
                columns = problem.mode_columns(float(np.exp(theta[mode])), float(np.exp(theta[modes + mode])))
                response += columns @ part
            spectrum = np.zeros((samples // 2 + 1, len(group.sensors)), dtype=np.complex128)
            spectrum[lines] = response
            histories = np.fft.irfft(spectrum, samples, axis=0)
            found.update(zip(group.sensors, histories.T, strict=True))
        return [between_samples(found[sensor], test.sampling_rate_hz) for sensor in test.sensors]


def _at(history: Interpolation, delay: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Return a history and its derivative at times that are later by `delay` [s], shape (samples,) each."""
    time = np.arange(delay.size) / rate_hz
    return history.with_slope(np.clip(time + delay, time[0], time[-1]))


def _late(history: Interpolation, test: FrameTest, highest: float) -> list[FloatArray]:
    """Return the effects of delays that are powers of time; 1 is a phase of 1 rad at the highest mode [rad/s]."""
    samples = test.responses.shape[0]
    slope = _at(history, np.zeros(samples), test.sampling_rate_hz)[1] / highest
    return [slope * np.linspace(-1.0, 1.0, samples) ** power for power in range(1, _POWERS + 1)]


def _spectra(columns: Sequence[FloatArray], spectrum: RecordSpectrum) -> ComplexArray:
    """Return the spectra of histories at the lines of a spectrum, shape (lines, columns)."""
    if not columns:
        return np.zeros((spectrum.omega.size, 0), dtype=np.complex128)
    lines = _lines(spectrum, columns[0].size)
    return np.array([np.fft.rfft(item)[lines] for item in columns]).T


def _lines(spectrum: RecordSpectrum, samples: int) -> IntArray:
    return np.round(spectrum.omega * samples * spectrum.dt / (2.0 * np.pi)).astype(np.int64)


def _turns(delays: FloatArray, highest: float) -> FloatArray:
    """Return the change of the phase between two clocks over a test at the highest mode [rad], shape (n, n)."""
    apart = delays[:, None, :: max(1, delays.shape[1] // 200)] - delays[None, :, :: max(1, delays.shape[1] // 200)]
    return np.asarray(np.ptp(apart, axis=2) * highest)


def _bases(fit: ProjectedFit, theta: FloatArray, index: int) -> dict[Sensor, tuple[FloatArray, FloatArray, FloatArray]]:
    """Return for each sensor of a test: orthogonal weighted basis, weights of the lines, and weighted residual."""
    found = {}
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        if group.tests != [index]:
            continue
        weight = np.concatenate([group.weight, group.weight])
        weighted = stack(state.basis) * weight[:, None]
        norms = np.linalg.norm(weighted, axis=0)
        q = np.linalg.qr(weighted / np.where(norms > 0.0, norms, 1.0))[0]
        residual = state.residual.reshape(weight.size, -1)
        for column, sensor in enumerate(group.sensors):
            found[sensor] = (q, weight / group.sigma[column], residual[:, column])
    return found


def _supported(
    columns: ComplexArray, limits: FloatArray, q: FloatArray, weight: FloatArray, residual: FloatArray
) -> ComplexArray:
    """Return the sum of the columns that the Bayesian information criterion supports, with real coefficients.

    No coefficient exceeds its limit. The column that reduces the residual most is added first, until no further one is
    supported.
    """
    seen = stack(columns) * weight[:, None]
    seen = seen - q @ (q.T @ seen)
    rows = q.shape[0] - q.shape[1]
    chosen: list[int] = []
    shares: FloatArray = np.zeros(0)
    cost = float(residual @ residual)
    while True:
        trials = []
        for column in sorted(set(range(seen.shape[1])) - set(chosen)):
            both = [*chosen, column]
            part = seen[:, both]
            trial = np.linalg.lstsq(part, residual, rcond=None)[0]
            if np.all(np.abs(trial) <= limits[both]):
                trials.append((float(np.sum((residual - part @ trial) ** 2)), column, trial))
        if not trials:
            break
        least, column, trial = min(trials, key=lambda item: item[0])
        if rows * np.log(cost / max(least, 1e-300)) <= np.log(rows):
            break
        chosen.append(column)
        shares, cost = np.asarray(trial), least
    return np.asarray(columns[:, chosen] @ shares)
