"""Clocks of sensors: delay of each sensor relative to the excitation, estimated from a fit and corrected.

A proportionally damped structure has real mode shapes: at a resonance all floors move in phase or in opposite phase. If
the clock of a sensor is late by tau, its residue at the frequency omega has the factor exp(-i omega tau), so one delay
explains the phases of all modes at this sensor. The response of each sensor is therefore fitted with real residues and
a delay that is constant, changes linearly with time, or steps once. The poles are those of a fit without this
restriction. A delay counts only if it predicts the phases of modes that were left out of its estimate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from mrpipe.artifacts import FloatArray
from mrpipe.modal.clocks.interpolation import between_samples
from mrpipe.modal.clocks.proof import LeftOut, parts_by_mode
from mrpipe.modal.fit.projection import Problem, stack
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest, Sensor
from mrpipe.modal.spectra import RecordSpectrum

_ITERATIONS = 20
"""Largest number of steps of Gauss-Newton."""
_CONVERGED = 0.1
"""Gauss-Newton has converged when no coefficient changes by more than this share of its standard error."""
_SCAN_PHASE = 1.0
"""Step of the scan over constant delays: phase of the highest mode [rad]. Gauss-Newton converges from nearer."""
_SCAN_STEPS = 16
"""Steps of the scan to each side."""
_LARGEST_DRIFT = 50e-6
"""Largest drift of the scan [1]. Quartz clocks are within 20 to 50 parts per million of the time."""
_STEP_ITERATIONS = 1
"""Steps of Gauss-Newton for each place of a step of the clock; only the best place is refined."""
_STEP_PLACES = 15
_SMOOTHED_LINES = 41
LEAST_PHASE = 0.02
"""Delays below this phase [rad] at the highest mode are not corrected, because filters and damping cause the same."""


@dataclass(frozen=True)
class SensorClock:
    """Delay of one sensor in one test: offset + drift * time + step after `step_at_s`.

    Attributes
    ----------
    test, sensor
        Where.
    offset_s, offset_error_s
        Delay at the start of the test, with its standard error [s].
    drift
        Change of the delay per second [1].
    step_s, step_at_s
        Step of the delay [s], and its time [s].
    """

    test: str
    sensor: Sensor
    offset_s: float
    offset_error_s: float
    drift: float = 0.0
    step_s: float = 0.0
    step_at_s: float = 0.0

    def delay(self, time: FloatArray) -> FloatArray:
        """Return the delay [s] at the times given."""
        return np.asarray(self.offset_s + self.drift * time + self.step_s * (time >= self.step_at_s))

    @property
    def is_zero(self) -> bool:
        """Whether no delay was found."""
        return self.offset_s == 0.0 and self.drift == 0.0 and self.step_s == 0.0


class _SensorFit:
    """Residual of one sensor in one test as a function of its delay, with real residues and the poles of a fit."""

    def __init__(
        self,
        test: FrameTest,
        spectrum: RecordSpectrum,
        column: int,
        basis: FloatArray,
        line_weight: FloatArray,
        poles: FloatArray,
    ) -> None:
        samples = test.responses.shape[0]
        self.time = np.arange(samples) / test.sampling_rate_hz
        centred = test.responses[:, column] - test.responses[:, column].mean()
        self.record = between_samples(centred, test.sampling_rate_hz)
        self.lines = np.round(spectrum.omega * samples * spectrum.dt / (2.0 * np.pi)).astype(np.int64)
        self.weight = np.concatenate([line_weight, line_weight])[:, None]
        weighted = basis * self.weight
        norms = np.linalg.norm(weighted, axis=0)
        self.q = np.linalg.qr(weighted / np.where(norms > 0.0, norms, 1.0))[0]

        self.left_out = LeftOut(self.q, parts_by_mode(spectrum.omega, poles, self.q.shape[1]))
        self.omega = spectrum.omega
        self.spectrum = spectrum.responses[:, column]

    def scanned(self, delays: FloatArray, drift: float = 0.0) -> FloatArray:
        """Return the cost of each delay at mid-record, shape (delays,), from a phase rotation (fast, approximate).

        Parameters
        ----------
        delays
            Delays at the middle of the record [s].
        drift
            Change of the delay per second [1].
        """
        spectrum = self.spectrum
        if drift:
            moved = self.time + drift * (self.time - self.time[-1] / 2.0)
            spectrum = np.fft.rfft(self.record(np.clip(moved, self.time[0], self.time[-1])))[self.lines]
        turned = stack(spectrum[:, None] * np.exp(1j * np.outer(self.omega, delays))) * self.weight
        along = self.q.T @ turned
        return np.asarray(np.sum(turned**2, axis=0) - np.sum(along**2, axis=0))

    def linearised(self, delay: FloatArray, changes: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return the residual at a delay, shape (2 lines,), and its derivative for each change of the delay."""
        moved = np.clip(self.time + delay, self.time[0], self.time[-1])
        value, slope = self.record.with_slope(moved)
        histories = [value, *(slope * change for change in changes)]
        values = np.column_stack([np.fft.rfft(item)[self.lines] for item in histories])
        columns = stack(values) * self.weight
        columns = columns - self.q @ (self.q.T @ columns)
        return columns[:, 0], columns[:, 1:]

    def left_out_costs(self, forms: Sequence[tuple[Sequence[FloatArray], FloatArray]]) -> FloatArray:
        """Return the cost of each part of the lines for a delay that is estimated from the other parts.

        Parameters
        ----------
        forms
            Changes of the delay and their coefficients from all lines; of several forms the other parts choose one.
        """
        trials = []
        for changes, value in forms:
            delay = np.tensordot(value, np.array(changes), axes=1) if changes else np.zeros(self.time.size)
            residual, derivative = self.linearised(np.asarray(delay), changes)
            trials.append(np.column_stack([residual, derivative]))
        return self.left_out.costs(trials)


def _minimise(
    fit: _SensorFit, changes: Sequence[FloatArray], start: FloatArray, iterations: int = _ITERATIONS
) -> tuple[FloatArray, float, FloatArray]:
    """Return coefficients of the changes, the cost at them, and their standard errors (Gauss-Newton)."""
    value = start.copy()
    for iteration in range(iterations + 1):
        residual, derivative = fit.linearised(np.tensordot(value, np.array(changes), axes=1), changes)
        cost = float(residual @ residual)
        variance = cost / max(residual.size - fit.q.shape[1], 1)
        spread = np.sqrt(np.diag(np.linalg.pinv(derivative.T @ derivative)) * variance)
        change = np.linalg.lstsq(derivative, residual, rcond=None)[0]
        if iteration == iterations or np.all(np.abs(change) <= _CONVERGED * spread):
            break
        value = value - change
    return value, cost, spread


def _constant_delay(fit: _SensorFit, highest: float) -> tuple[FloatArray, float, FloatArray]:
    """Return the constant delay, shape (1,), its cost, and its standard error.

    The cost has several minima, about half a period of a strong mode apart, because real residues may have either
    sign. The minimum nearest to zero is replaced by another one only if that one predicts modes which were left out
    of its estimate better.
    """
    delays = _scan_steps(highest)
    start = delays[int(np.argmin(fit.scanned(delays)))]
    return _better_minimum(fit, [np.ones(fit.time.size)], np.zeros(1), np.array([start]), _SCAN_PHASE / highest)


def _drifting_delay(fit: _SensorFit, offset: FloatArray, highest: float) -> tuple[FloatArray, float, FloatArray]:
    """Return the delay at the start and its drift, shape (2,), the cost, and the standard errors.

    The minimum nearest to a constant delay is replaced only as in :func:`_constant_delay`. The scan covers drifts as
    well, because a constant delay can be at a minimum that is wrong for a clock which drifts.
    """
    middle = float(fit.time[-1]) / 2.0
    step = _SCAN_PHASE / (highest * middle)
    count = int(_LARGEST_DRIFT / step)
    delays, drifts = _scan_steps(highest), step * np.arange(-count, count + 1)
    costs = np.array([fit.scanned(delays, float(drift)) for drift in drifts])
    row, column = np.unravel_index(int(np.argmin(costs)), costs.shape)
    start = np.array([delays[column] - drifts[row] * middle, drifts[row]])
    near = np.array([offset[0], 0.0])
    return _better_minimum(fit, [np.ones(fit.time.size), fit.time], near, start, _SCAN_PHASE / highest)


def _scan_steps(highest: float) -> FloatArray:
    """Return the delays of the scan [s] for the highest angular frequency [rad/s]."""
    return np.asarray(_SCAN_PHASE / highest * np.arange(-_SCAN_STEPS, _SCAN_STEPS + 1))


def _better_minimum(
    fit: _SensorFit, changes: Sequence[FloatArray], near: FloatArray, far: FloatArray, apart: float
) -> tuple[FloatArray, float, FloatArray]:
    """Return the minimum from the start `near`, or that from `far` if it predicts modes that were left out better.

    Both starts lead to the same minimum if their delays differ by no more than `apart` [s].
    """
    first = _minimise(fit, changes, near)
    between = np.tensordot(far - first[0], np.array(changes), axes=1)
    if float(np.abs(between).max()) <= apart or len(fit.left_out.rows) < 2:
        return first
    second = _minimise(fit, changes, far)
    costs = [fit.left_out_costs([(changes, item[0])]) for item in (second, first)]
    return second if fit.left_out.proves(*costs) else first


def _supported(fit: _SensorFit, better: float, worse: float, parameters: int) -> bool:
    """Return whether the Bayesian information criterion supports a delay with this number of additional parameters.

    By chance a delay that only fits noise can predict the lines that were left out, and several positions of a step are
    tried for each sensor. The validation by left-out lines is therefore not sufficient.
    """
    rows = fit.q.shape[0] - fit.q.shape[1]
    return bool(rows * np.log(worse / max(better, 1e-300)) > parameters * np.log(rows))


def _sensor_clock(fit: _SensorFit, name: str, sensor: Sensor, steps: bool, highest: float) -> SensorClock:
    """Return the delay of a sensor: none, constant, drifting or with a step.

    Each form must be better than the simpler ones on modes that were left out, and all lines must support it.
    """
    ones, time = np.ones(fit.time.size), fit.time
    offset, cost, spread = _constant_delay(fit, highest)
    best = SensorClock(name, sensor, 0.0, float(spread[0]))
    if len(fit.left_out.rows) < 2:
        return best
    simple, simple_cost, free = fit.left_out_costs([([], np.zeros(0))]), float(fit.scanned(np.zeros(1))[0]), 1
    own = fit.left_out_costs([([ones], offset)])
    if fit.left_out.proves(own, simple) and _supported(fit, cost, simple_cost, 1):
        best = SensorClock(name, sensor, float(offset[0]), float(spread[0]))
        simple, simple_cost, free = own, cost, 0
    value, drift_cost, spread = _drifting_delay(fit, offset, highest)
    drift = fit.left_out_costs([([ones, time], value)])
    changes = fit.left_out.proves(drift, simple) and _supported(fit, drift_cost, simple_cost, 1 + free)
    stepping = _step(fit, offset) if steps else None
    if stepping is not None:
        left_out, size, size_spread, step_cost, at = stepping
        proven = fit.left_out.proves(left_out, simple) and _supported(fit, step_cost, simple_cost, 2 + free)
        if proven and fit.left_out.proves(left_out, drift) and _supported(fit, step_cost, drift_cost, 1):
            best = SensorClock(name, sensor, float(size[0]), float(size_spread[0]), 0.0, float(size[1]), at)
            changes = False
        # where a step is proven against a constant delay, but not against a drift, the drift has fewer parameters
        changes = changes or (proven and not best.step_s)
    if changes:
        best = SensorClock(name, sensor, float(value[0]), float(spread[0]), float(value[1]))
    if float(np.abs(best.delay(time)).max()) * highest < LEAST_PHASE:
        return SensorClock(name, sensor, 0.0, best.offset_error_s)
    return best


def _step(fit: _SensorFit, offset: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Return of the best step: left-out costs, coefficients (offset and step), their errors, cost, and place [s]."""
    forms = _step_forms(fit, offset)
    left_out = fit.left_out_costs([(shape, size) for shape, size, *_ in forms])
    shape, size, _, _, at = min(forms, key=lambda item: item[3])
    value, cost, spread = _minimise(fit, shape, size)
    return left_out, value, spread, cost, at


def _step_forms(
    fit: _SensorFit, offset: FloatArray
) -> list[tuple[list[FloatArray], FloatArray, FloatArray, float, float]]:
    """Return for each position of a step: changes of the delay, coefficients, errors, cost, and position [s]."""
    forms = []
    for at in np.linspace(fit.time[0], fit.time[-1], _STEP_PLACES + 2)[1:-1]:
        changes = [np.ones(fit.time.size), (fit.time >= at).astype(np.float64)]
        value, cost, spread = _minimise(fit, changes, np.array([offset[0], 0.0]), _STEP_ITERATIONS)
        forms.append((changes, value, spread, cost, float(at)))
    return forms


def estimate_clocks(fit: MultiModeFit, tests: Sequence[FrameTest], steps: bool = True) -> list[SensorClock]:
    """Return the delay of each sensor in each test, relative to the excitations of that test.

    Parameters
    ----------
    fit
        A fit of these tests.
    tests
        Tests in the order of the fit.
    steps
        Whether a delay may have a step.
    """
    found = []
    modes = list(zip(fit.angular_frequencies, fit.damping_ratios, strict=True))
    for test, spectrum, measured, steady in zip(tests, fit.spectra, fit.measured, fit.steady, strict=True):
        variance = uniform_filter1d(np.abs(measured - steady) ** 2, _SMOOTHED_LINES, axis=0, mode="nearest")
        # lines with a very small residual must not dominate the fit
        variance = np.maximum(variance, 0.1 * np.median(variance, axis=0))
        for is_displacement in sorted(set(test.is_displacement)):
            problem = Problem([spectrum], len(modes), is_displacement)
            inputs = len(problem.inputs)
            keep = [*range(0, 2 * inputs, 2), 2 * inputs, 2 * inputs + 1]
            columns = [problem.mode_columns(float(omega), float(zeta))[:, keep] for omega, zeta in modes]
            basis = stack(np.hstack([*columns, problem.smooth_columns()]))
            for column, sensor in enumerate(test.sensors):
                if sensor.is_displacement == is_displacement:
                    weight = 1.0 / np.sqrt(np.maximum(variance[:, column], 1e-300))
                    own = _SensorFit(test, spectrum, column, basis, weight, fit.angular_frequencies)
                    highest = float(fit.angular_frequencies[-1])
                    found.append(_sensor_clock(own, test.name, sensor, steps, highest))
    return found


def corrected(test: FrameTest, clocks: Sequence[SensorClock]) -> FrameTest:
    """Return a test in which interpolation has removed the delays of its sensors."""
    time = np.arange(test.responses.shape[0]) / test.sampling_rate_hz
    responses = test.responses.copy()
    for clock in clocks:
        if clock.test == test.name and not clock.is_zero:
            column = test.sensors.index(clock.sensor)
            moved = np.clip(time + clock.delay(time), time[0], time[-1])
            responses[:, column] = between_samples(test.responses[:, column], test.sampling_rate_hz)(moved)
    return replace(test, responses=responses)


def added(first: Sequence[SensorClock], second: Sequence[SensorClock]) -> list[SensorClock]:
    """Return the sum of two corrections, of which at most one has a step for the same sensor."""
    known = {(item.test, item.sensor): item for item in first}
    result = dict(known)
    for item in second:
        before = known.get((item.test, item.sensor))
        if before is None:
            result[(item.test, item.sensor)] = item
            continue
        result[(item.test, item.sensor)] = SensorClock(
            item.test,
            item.sensor,
            before.offset_s + item.offset_s,
            item.offset_error_s,
            before.drift + item.drift,
            before.step_s + item.step_s,
            item.step_at_s if item.step_s else before.step_at_s,
        )
    return list(result.values())


def expected_clocks(
    clocks: Sequence[SensorClock], tests: Sequence[FrameTest], others: Sequence[FrameTest]
) -> list[SensorClock]:
    """Return the delays that sensors had in all tests of the fit, for tests that were not fitted.

    A delay counts if each test of the fit has it for the same sensor, with a scatter below a fifth of its value.

    Parameters
    ----------
    clocks
        Delays of the sensors of `tests`.
    tests
        Tests of the fit.
    others
        Tests that were not fitted.
    """
    found = []
    for sensor in dict.fromkeys(item.sensor for item in clocks):
        having = [test.name for test in tests if sensor in test.sensors]
        own = [item for item in clocks if item.sensor == sensor and item.test in having]
        offsets = np.array([item.offset_s for item in own])
        steady = all(item.drift == 0.0 and item.step_s == 0.0 for item in own)
        if steady and len(own) == len(having) >= 2 and offsets.std() < 0.2 * abs(offsets.mean()):
            error = float(offsets.std())
            found += [
                SensorClock(test.name, sensor, float(offsets.mean()), error)
                for test in others
                if sensor in test.sensors
            ]
    return found
