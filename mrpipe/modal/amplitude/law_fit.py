"""Fit of amplitude-dependent modes to forced tests, and their validation on tests left out.

Laws of frequency and damping are fitted to the records in the time domain by least squares inside the band; shapes and
the contribution of higher modes are the linear part. Each record has the same weight. Laws are used only where they
predict records that were left out of the fit better than constant modes do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray
from mrpipe.modal.amplitude.dependence import AmplitudeDependence, explains
from mrpipe.modal.amplitude.laws import (
    AmplitudeLaws,
    AmplitudeModel,
    Measure,
    Motion,
    initial_state,
    input_columns,
    simulated,
)
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest, Place, Sensor
from mrpipe.modal.spectra import ComplexArray

_LEAST_GAIN = 0.05
_SUFFICIENT = 0.03
"""RMS error over RMS response below which constant modes are sufficient. An error of a natural frequency of a fiftieth
of the half-power bandwidth has about this effect."""
_LEAST_ENERGY = 0.05
"""Share of the energy of a mode below the smallest amplitude at which its law is reported."""
_EVALUATIONS = 25
_STEP = 1e-5
_START_SOFTENING = 0.005
_START_DAMPING = 0.3


class _Record:
    """A test in the form that the fit needs: spectra inside the band, for the part of the time that counts."""

    def __init__(self, test: FrameTest, model: _Common, name: str, counts: FloatArray) -> None:
        self.name = name
        self.test = test
        self.counts = counts
        self.dt = 1.0 / test.sampling_rate_hz
        frequency = np.fft.rfftfreq(test.responses.shape[0], self.dt)
        self.lines = (frequency >= model.band_hz[0]) & (frequency <= model.band_hz[1])
        self.inputs = input_columns(test, model.inputs)
        self.forces = self.inputs @ model.gains
        self.rows = [model.sensors.index(sensor) for sensor in test.sensors]
        target = self.spectra(test.responses - test.responses.mean(axis=0))
        self.power = float(np.sum(np.abs(target) ** 2))
        self.scale = np.maximum(np.linalg.norm(target, axis=0), 1e-300)
        self.target = target / self.scale
        self.input_spectra = self.spectra(self.inputs)
        self.initial = np.zeros((model.modes, 2))
        # the derivative with respect to a parameter of one mode needs the other modes again and again
        self._column = lru_cache(maxsize=4 * model.modes)(self._simulated_column)

    def spectra(self, histories: FloatArray) -> ComplexArray:
        return np.asarray(np.fft.rfft(histories * self.counts[:, None], axis=0)[self.lines])

    def simulated(self, laws: AmplitudeLaws) -> Motion:
        """Return the motion of the modes in this test."""
        return simulated(laws, self.forces, self.dt, self.initial)

    def mode_columns(self, laws: AmplitudeLaws) -> ModeSpectra:
        """Return the spectra of the modes; modes do not depend on each other unless a law has the whole motion."""
        if laws.measure == "motion":
            return self._spectra_of(self.simulated(laws))
        columns = [
            self._column(mode, tuple(map(float, row)), tuple(map(float, initial)))
            for mode, (row, initial) in enumerate(zip(laws.rows(), self.initial, strict=True))
        ]
        displacement, acceleration = zip(*columns, strict=True)
        return np.hstack(displacement), np.hstack(acceleration)

    def _simulated_column(self, mode: int, row: tuple[float, ...], initial: tuple[float, ...]) -> ModeSpectra:
        law = AmplitudeLaws("mode", *np.array(row)[:, None])
        return self._spectra_of(simulated(law, self.forces[:, mode : mode + 1], self.dt, np.array([initial])))

    def _spectra_of(self, motion: Motion) -> ModeSpectra:
        kinds = self.test.is_displacement
        none = np.zeros((0, motion.displacement.shape[1]), dtype=np.complex128)
        return (
            self.spectra(motion.displacement) if any(kinds) else none,
            none if all(kinds) else self.spectra(motion.acceleration),
        )


ModeSpectra = tuple[ComplexArray, ComplexArray]
"""Displacement and acceleration of modes, each of shape (lines, r); no lines where no sensor measures it."""


@dataclass(frozen=True)
class _Common:
    """Data that all fits share."""

    sensors: tuple[Sensor, ...]
    inputs: tuple[Place, ...]
    gains: FloatArray
    band_hz: tuple[float, float]
    modes: int


def _common(fit: MultiModeFit) -> _Common:
    """Return inputs and gains: modes are scaled to the sensor that moves most, so that amplitudes are metres there."""
    most = np.argmax(np.abs(fit.residues), axis=0)
    columns = np.arange(fit.residues.shape[1])
    signs = np.array([-1.0 if place.floor == 0 else 1.0 for place in fit.inputs])
    gains = signs[:, None] * np.real(fit.residues[most, columns] * fit.participations)
    low = min(float(item[0]) for item in fit.omega) / (2.0 * np.pi)
    # beyond its highest mode the model is that of modes above the band
    high = 1.15 * float(fit.angular_frequencies[-1]) / (2.0 * np.pi)
    return _Common(fit.sensors, fit.inputs, gains, (low, high), columns.size)


class _Problem:
    """Errors of the records for given laws; shapes and direct terms by linear least squares for each sensor."""

    def __init__(self, common: _Common, records: Sequence[_Record], measure: Measure) -> None:
        self.common = common
        self.records = records
        self.measure: Measure = measure

    def laws(self, theta: FloatArray) -> AmplitudeLaws:
        r = self.common.modes
        references = np.exp(theta[4 * r :])
        return AmplitudeLaws(
            self.measure,
            np.exp(theta[:r]),
            np.exp(theta[r : 2 * r]),
            theta[2 * r : 3 * r],
            theta[3 * r : 4 * r],
            np.broadcast_to(references, (r,)) if references.size == 1 else references,
        )

    def bases(self, laws: AmplitudeLaws, record: _Record) -> tuple[ComplexArray, ComplexArray]:
        """Return the columns for displacements and for accelerations of a record, each of shape (lines, r + k)."""
        first, second = record.mode_columns(laws)
        inputs = record.input_spectra
        return np.hstack([first, inputs[: len(first)]]), np.hstack([second, inputs[: len(second)]])

    def solve(self, theta: FloatArray) -> tuple[FloatArray, list[ComplexArray]]:
        """Return coefficients, shape (sensors, r + k), and the relative error spectra of each record."""
        laws = self.laws(theta)
        bases = [self.bases(laws, record) for record in self.records]
        width = self.common.modes + len(self.common.inputs)
        coefficients = np.zeros((len(self.common.sensors), width))
        grams = [[np.real(basis.conj().T @ basis) for basis in pair] for pair in bases]
        for row, sensor in enumerate(self.common.sensors):
            left, right = np.zeros((width, width)), np.zeros(width)
            for record, pair, gram in zip(self.records, bases, grams, strict=True):
                if row in record.rows:
                    kind, column = int(not sensor.is_displacement), record.rows.index(row)
                    weight = 1.0 / record.scale[column]
                    left += weight**2 * gram[kind]
                    right += weight * np.real(pair[kind].conj().T @ record.target[:, column])
            size = np.sqrt(np.maximum(np.diag(left), 1e-300))
            coefficients[row] = np.linalg.lstsq(left / np.outer(size, size), right / size, rcond=1e-12)[0] / size
        errors = [self.errors(record, pair, coefficients) for record, pair in zip(self.records, bases, strict=True)]
        return coefficients, errors

    def start_in_motion(self, theta: FloatArray) -> None:
        """Estimate the motion at the first sample of each record, with the coefficients of records at rest."""
        laws, r = self.laws(theta), self.common.modes
        coefficients = self.solve(theta)[0]
        shapes, direct = coefficients[:, :r], coefficients[:, r:]
        for record in self.records:
            arguments = (record.test, record.inputs, record.forces, self.common.sensors)
            record.initial = initial_state(laws, shapes, direct, *arguments)

    def errors(
        self, record: _Record, pair: tuple[ComplexArray, ComplexArray], coefficients: FloatArray
    ) -> ComplexArray:
        parts = []
        for column, (row, sensor) in enumerate(zip(record.rows, record.test.sensors, strict=True)):
            simulated = pair[int(not sensor.is_displacement)] @ coefficients[row]
            parts.append(record.target[:, column] - simulated / record.scale[column])
        return np.column_stack(parts)

    def residual(self, theta: FloatArray) -> FloatArray:
        errors = np.concatenate([item.ravel() for item in self.solve(theta)[1]])
        return np.concatenate([errors.real, errors.imag])

    def left_out_error(self, theta: FloatArray, coefficients: FloatArray, record: _Record) -> float:
        """Return squared error over squared response of a record that is not part of the fit."""
        error = self.errors(record, self.bases(self.laws(theta), record), coefficients)
        return float(np.sum(np.abs(error * record.scale) ** 2) / max(record.power, 1e-300))


def _jacobian(problem: _Problem, theta: FloatArray, free: Sequence[int], start: FloatArray | None = None) -> FloatArray:
    """Return the derivatives of the residual with respect to the free parameters; `start` is the residual itself."""
    start = problem.residual(theta) if start is None else start
    columns = []
    for index in free:
        moved = theta.copy()
        moved[index] += _STEP
        columns.append((problem.residual(moved) - start) / _STEP)
    return np.column_stack(columns)


def _start(common: _Common, fit: MultiModeFit, level: FloatArray) -> FloatArray:
    r = common.modes
    return np.concatenate([np.log(fit.angular_frequencies), np.log(fit.damping_ratios), np.zeros(2 * r), np.log(level)])


def _free(problem: _Problem, theta: FloatArray) -> list[int]:
    """Return the parameters that a fit changes: frequency and damping alone for constant modes."""
    return list(range(2 * problem.common.modes if problem.measure == "constant" else theta.size))


def _fitted(problem: _Problem, theta: FloatArray, evaluations: int = _EVALUATIONS) -> FloatArray:
    """Return the parameters after least squares from a start."""
    r = problem.common.modes
    free = _free(problem, theta)
    levels = theta.size - 4 * r
    reach = np.concatenate([_reach(r), np.full(levels, 3.0)])

    def whole(values: FloatArray) -> FloatArray:
        result = theta.copy()
        result[free] = values
        return result

    last: tuple[FloatArray, FloatArray] | None = None

    def residual(values: FloatArray) -> FloatArray:
        nonlocal last
        last = values.copy(), problem.residual(whole(values))
        return last[1]

    def jacobian(values: FloatArray) -> FloatArray:
        known = last[1] if last is not None and np.array_equal(last[0], values) else None
        return _jacobian(problem, whole(values), free, known)

    result = least_squares(
        residual,
        theta[free],
        jac=jacobian,
        bounds=((theta - reach)[free], (theta + reach)[free]),
        x_scale=(0.1 * reach)[free],
        max_nfev=evaluations,
        ftol=1e-4,
        xtol=1e-5,
    )
    return whole(np.asarray(result.x))


def _levels(problem: _Problem, theta: FloatArray) -> FloatArray:
    """Return a middle amplitude of each mode [m], shape (r,), and of the whole motion for laws of that measure."""
    values = [simulated(problem.laws(theta), record.forces, record.dt) for record in problem.records]
    if problem.measure == "motion":
        return np.array([max(0.3 * float(np.median([item.amplitude.max() for item in values])), 1e-12)])
    peaks = np.array([np.abs(item.displacement).max(axis=0) for item in values])
    return np.asarray(np.maximum(0.3 * np.median(peaks, axis=0), 1e-12))


def _begin(problem: _Problem, constant: FloatArray) -> FloatArray | None:
    """Return the start of a law from the fit of constant modes; None if no law can reduce their error (score test).

    The start is the better one of a linear step from constant modes and of laws that soften a little.
    """
    r = problem.common.modes
    theta = np.concatenate([constant[: 4 * r], np.log(_levels(problem, constant))])
    residual = problem.residual(theta)
    jacobian = _jacobian(problem, theta, range(4 * r), residual)
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    costs = []
    for count in (2 * r, 4 * r):
        part = jacobian[:, :count] / size[:count]
        step = np.linalg.lstsq(part, residual, rcond=1e-10)[0]
        costs.append(float(np.sum((residual - part @ step) ** 2)))
    if costs[1] > (1.0 - _LEAST_GAIN) * costs[0]:
        return None
    reach = 0.9 * _reach(r)
    linear = theta.copy()
    linear[: 4 * r] -= np.clip(step / size, -reach, reach)
    level = np.log(2.0)
    theta[2 * r : 3 * r], theta[3 * r : 4 * r] = _START_SOFTENING, _START_DAMPING
    theta[:r] += _START_SOFTENING * level
    theta[r : 2 * r] -= _START_DAMPING * level
    return min((linear, theta), key=lambda item: float(np.sum(problem.residual(item) ** 2)))


def _reach(modes: int) -> FloatArray:
    """Return the largest change of the parameters in a fit: frequency, damping, and two exponents of each mode."""
    return np.repeat([0.06, 1.8, 0.15, 1.5], modes)


def _folds(tests: Sequence[FrameTest], common: _Common) -> tuple[list[_Record], list[_Record]]:
    """Return the records of the fit, and the parts left out in turn: a test, or half the energy of the only one."""
    whole = [_Record(test, common, test.name, np.ones(test.responses.shape[0])) for test in tests]
    if len(whole) > 1:
        return whole, whole
    test = tests[0]
    energy = np.cumsum(np.sum((test.responses - test.responses.mean(axis=0)) ** 2, axis=1))
    first = np.asarray(energy <= 0.5 * energy[-1], dtype=np.float64)
    halves = [
        _Record(test, common, f"{test.name}, first half", first),
        _Record(test, common, f"{test.name}, second half", 1.0 - first),
    ]
    return whole, halves


def find_amplitude_dependence(fit: MultiModeFit, tests: Sequence[FrameTest]) -> AmplitudeDependence | None:
    """Return amplitude-dependent modes if they predict records left out of the fit better than constant modes.

    Parameters
    ----------
    fit
        Constant modes: the start, and the shapes that scale the amplitudes.
    tests
        Training tests, with measured excitation and corrected clocks. A single test is divided into two halves of
        equal energy of the response.

    Returns
    -------
    The model fitted to all tests, and the errors of the fits that left one out; None where no law is better.
    """
    common = _common(fit)
    whole, parts = _folds(tests, common)
    problem = _Problem(common, whole, "constant")
    start = _start(common, fit, np.ones(1))
    problem.start_in_motion(start)
    for part in parts:
        # parts of one test share its start
        part.initial = next(record.initial for record in whole if record.test is part.test)
    constant = _fitted(problem, start)
    power = sum(record.target.shape[1] for record in whole)
    if float(np.sum(problem.residual(constant) ** 2)) < _SUFFICIENT**2 * power:
        return None
    fits: dict[Measure, FloatArray] = {"constant": constant}
    measures: tuple[Measure, ...] = ("motion", "mode")
    for measure in measures:
        problem = _Problem(common, whole, measure)
        start_of_law = _begin(problem, constant)
        if start_of_law is not None:
            fits[measure] = _fitted(problem, start_of_law)
    if len(fits) == 1:
        return None
    errors = {measure: _left_out(common, parts, measure, theta) for measure, theta in fits.items()}
    best = min(errors, key=lambda measure: float(np.mean(errors[measure])))
    if best == "constant" or not explains(errors["constant"], errors[best]):
        return None
    names = tuple(record.name for record in parts)
    model = _model(_Problem(common, whole, best), fits[best])
    return AmplitudeDependence(model, names, tuple(errors["constant"]), tuple(errors[best]))


def _left_out(common: _Common, parts: Sequence[_Record], measure: Measure, start: FloatArray) -> list[float]:
    """Return the error of each part for a fit to the others."""
    errors = []
    for part in parts:
        problem = _Problem(common, [other for other in parts if other is not part], measure)
        theta = _fitted(problem, start)
        errors.append(problem.left_out_error(theta, problem.solve(theta)[0], part))
    return errors


def _model(problem: _Problem, theta: FloatArray) -> AmplitudeModel:
    common, laws = problem.common, problem.laws(theta)
    coefficients = problem.solve(theta)[0]
    shapes, direct = coefficients[:, : common.modes], coefficients[:, common.modes :]
    smallest, largest = _seen(problem, laws)
    return AmplitudeModel(laws, common.sensors, common.inputs, common.gains, shapes, direct, largest, smallest)


def _seen(problem: _Problem, laws: AmplitudeLaws) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and the largest amplitude that counts for each mode over all records, shape (r,) each [m].

    The smallest is the amplitude below which the records contain 5 % of the energy of the mode; below it the signal is
    mostly noise.
    """
    motions = [record.simulated(laws) for record in problem.records]
    own = np.abs(np.concatenate([item.displacement for item in motions]))
    if laws.measure == "motion":
        amplitude = np.concatenate([item.amplitude for item in motions])[:, None] * np.ones(own.shape[1])
    else:
        amplitude = own
    order = np.argsort(amplitude, axis=0)
    energy = np.cumsum(np.take_along_axis(own**2, order, axis=0), axis=0)
    first = np.argmax(energy >= _LEAST_ENERGY * energy[-1], axis=0)
    place = np.take_along_axis(order, first[None], axis=0)
    return np.take_along_axis(amplitude, place, axis=0)[0], np.asarray(amplitude.max(axis=0))
