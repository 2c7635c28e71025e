"""Multi-mode fit of whole-record spectra with leakage modelled: poles by variable projection, the rest linear.

In a record of finite length the spectrum of a response is exactly Y = H U + T, where T holds what the modes carried
over the record's beginning and end and has the poles of H. Frames damped by a tenth of a per cent ring for longer than
a test lasts, so T is as large as H U at the peaks; averaging with windows would smear both into too much damping.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray
from mrpipe.modal.projection import DIRECT_POWERS, Problem, State, evaluate, stack
from mrpipe.modal.rank_one import rank_one
from mrpipe.modal.records import Place, Sensor
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum, all_inputs, all_sensors


@dataclass(frozen=True)
class MultiModeFit:
    """Result of :func:`fit_modes`; modes in rising order.

    Attributes
    ----------
    angular_frequencies, damping_ratios
        Shape (r,) [rad/s], [1].
    covariance
        Shape (2r, 2r) of (ln omega, ln zeta), robust to residuals that are not white.
    residues
        Shape (n, r) complex: amplitude of mode r at sensor i in acceleration over the first input, its phase referred
        to that of a proportionally damped frame (0 or pi). With several inputs: the mode's shape times its
        participation in the first input that excites it most.
    residue_errors
        Shape (n, r): standard error of the residues due to noise of the responses. Noise of the excitation scales all
        residues of a mode alike and does not change its shape.
    coherence
        Shape (n, r): share of the response near the peak that the excitation and the ends of the record explain.
    steady, measured
        One entry a test, shape (m, s): H U of the fit, and the measured response without its transient part. Columns
        are the sensors of the test.
    omega
        One entry a test, shape (m,) [rad/s].
    excitation
        One entry a test, shape (m,): the first input of the test.
    noise_variance
        Shape (n,): variance of a spectral line far from the peaks.
    sensors
        Place and kind of each row of `residues`.
    inputs
        Places of the inputs.
    participations
        Shape (k, r) complex: what an input contributes to a mode, relative to the input of `residues`.
    input_residues
        Shape (n, k, r) complex: the residues of each input; nan if no test has this sensor and this input.
    spectra
        The spectra that were fitted.
    transients
        One entry a test, shape (m, s): contribution of the ends of the record.
    """

    angular_frequencies: FloatArray
    damping_ratios: FloatArray
    covariance: FloatArray
    residues: ComplexArray
    residue_errors: FloatArray
    coherence: FloatArray
    steady: tuple[ComplexArray, ...]
    measured: tuple[ComplexArray, ...]
    omega: tuple[FloatArray, ...]
    excitation: tuple[ComplexArray, ...]
    noise_variance: FloatArray
    sensors: tuple[Sensor, ...] = ()
    inputs: tuple[Place, ...] = ()
    participations: ComplexArray = field(default_factory=lambda: np.ones((1, 1), dtype=np.complex128))
    input_residues: ComplexArray = field(default_factory=lambda: np.ones((1, 1, 1), dtype=np.complex128))
    spectra: tuple[RecordSpectrum, ...] = ()
    transients: tuple[ComplexArray, ...] = ()

    def mode_coherence(self) -> FloatArray:
        """Coherence at each peak, shape (r,): mean over floors, weighted by the squared shape."""
        weight = np.abs(self.residues) ** 2
        return np.asarray(np.sum(weight * self.coherence, axis=0) / np.maximum(np.sum(weight, axis=0), 1e-300))

    def only(self, modes: Sequence[int]) -> MultiModeFit:
        """Return the fit with the poles of `modes` alone (the steady response keeps all)."""
        index = np.asarray(modes, dtype=np.int64)
        count = self.angular_frequencies.size
        both = np.concatenate([index, index + count])
        return replace(
            self,
            angular_frequencies=self.angular_frequencies[index],
            damping_ratios=self.damping_ratios[index],
            covariance=self.covariance[np.ix_(both, both)],
            residues=self.residues[:, index],
            residue_errors=self.residue_errors[:, index],
            coherence=self.coherence[:, index],
            participations=self.participations[:, index],
            input_residues=self.input_residues[:, :, index],
        )

    def residual(self) -> ComplexArray:
        """Part that neither excitation nor transients explain, all tests in one column, shape (sum m, n).

        Zero where a test does not have a sensor.
        """
        parts = []
        for item, measured, steady in zip(self.spectra, self.measured, self.steady, strict=True):
            part = np.zeros((item.omega.size, len(self.sensors)), dtype=np.complex128)
            part[:, [self.sensors.index(sensor) for sensor in item.sensors]] = measured - steady
            parts.append(part)
        return np.vstack(parts)


@dataclass
class _Group:
    """Sensors of one kind that the same tests have: they share one linear basis."""

    problem: Problem
    sensors: list[Sensor]
    tests: list[int]
    target: ComplexArray
    smooth: ComplexArray
    sigma: FloatArray
    weight: FloatArray
    input_noise: float = 0.0


def _groups(spectra: Sequence[RecordSpectrum], modes: int, separate: bool) -> list[_Group]:
    members: dict[tuple[bool, tuple[int, ...]], list[Sensor]] = {}
    for sensor in all_sensors(spectra):
        tests = tuple(index for index, item in enumerate(spectra) if sensor in item.sensors)
        for shared in [(index,) for index in tests] if separate else [tests]:
            members.setdefault((sensor.is_displacement, shared), []).append(sensor)
    groups = []
    for (is_displacement, tests), sensors in members.items():
        own = [spectra[index] for index in tests]
        problem = Problem(own, modes, is_displacement)
        target = np.vstack([item.responses[:, [item.sensors.index(sensor) for sensor in sensors]] for item in own])
        sigma = np.maximum(np.std(target, axis=0), 1e-300)
        ones = np.ones(problem.total)
        groups.append(_Group(problem, sensors, list(tests), target, problem.smooth_columns(), sigma, ones))
    return groups


class ProjectedFit:
    """Variable projection over all groups of sensors, with weights renewed from the residuals.

    With `separate`, each test has separate residues; else tests share the residues of their common sensors.
    """

    def __init__(self, spectra: Sequence[RecordSpectrum], modes: int, separate: bool = False) -> None:
        self.groups = _groups(spectra, modes, separate)
        self._cache: tuple[bytes, list[State]] | None = None

    def states(self, theta: FloatArray) -> list[State]:
        """Return the projection of each group at theta."""
        key = theta.tobytes()
        if self._cache is None or self._cache[0] != key:
            states = []
            for group in self.groups:
                both = np.concatenate([group.weight, group.weight])
                target = stack(group.target / group.sigma) * both[:, None]
                states.append(evaluate(group.problem, group.smooth, theta, target, both))
            self._cache = (key, states)
        return self._cache[1]

    def residual(self, theta: FloatArray) -> FloatArray:
        """Return the weighted residuals of all groups in one column."""
        return np.concatenate([state.residual for state in self.states(theta)])

    def compressed(self, theta: FloatArray) -> FloatArray:
        """Triangle R of [J e]: a problem of a few rows with the same norm, gradient and J'J (exact compression)."""
        jacobian, residual = self.jacobian(theta), self.residual(theta)
        cross = jacobian.T @ residual
        gram = np.block([[jacobian.T @ jacobian, cross[:, None]], [cross[None, :], np.array([[residual @ residual]])]])
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        try:
            return np.asarray(np.linalg.cholesky(gram / np.outer(scale, scale)).T * scale)
        except np.linalg.LinAlgError:
            return np.asarray(np.linalg.qr(np.column_stack([jacobian, residual]), mode="r"))

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Return the derivative of the residuals by theta."""
        return np.vstack([state.jacobian for state in self.states(theta)])

    def renew_weights(self, theta: FloatArray) -> None:
        """Noise of the excitation is amplified at the peaks: variance = s_y2 + |H|2 s_u2, estimated from residuals."""
        for group, state in zip(self.groups, self.states(theta), strict=True):
            unweighted = self.complex_residual(group, state)
            response = np.abs(self.steady(group, state)) ** 2 / self.input_power(group)[:, None]
            total = np.zeros(group.problem.total)
            noise = []
            for column in range(len(group.sensors)):
                power = np.abs(unweighted[:, column]) ** 2
                quiet = response[:, column] <= np.median(response[:, column])
                floor = max(float(np.mean(power[quiet])), 1e-300)
                loud = response[:, column] >= np.quantile(response[:, column], 0.97)
                gain = max(float(np.mean(response[loud, column])), 1e-300)
                amplified = max(float(np.mean(power[loud]) - floor), 0.0) / gain
                group.sigma[column] = np.sqrt(floor / 2.0)
                noise.append(amplified)
                total = np.maximum(total, amplified * response[:, column] / floor)
            group.weight = 1.0 / np.sqrt(1.0 + total)
            group.input_noise = float(np.sqrt(np.median(noise)))
        self._cache = None

    @staticmethod
    def input_power(group: _Group) -> FloatArray:
        """Squared magnitude of the inputs, each relative to its own scale, in the unit of the first, shape (rows,)."""
        scale = group.problem.scale
        power = np.sum(np.abs(np.concatenate(group.problem.excitations) / scale) ** 2, axis=1) * scale[0] ** 2
        return np.asarray(np.maximum(power, 1e-300))

    @staticmethod
    def complex_residual(group: _Group, state: State) -> ComplexArray:
        """Residual of a group in the unit of its spectra."""
        return group.target - state.basis @ (state.coefficients * group.sigma)

    @staticmethod
    def coefficient_errors(group: _Group, state: State) -> FloatArray:
        """Standard errors of the coefficients of a group for responses of unit noise, shape (columns,)."""
        weight = np.concatenate([group.weight, group.weight])
        weighted = stack(state.basis) * weight[:, None]
        norms = np.maximum(np.linalg.norm(weighted, axis=0), 1e-300)
        inverse = np.linalg.pinv(np.linalg.qr(weighted / norms, mode="r"))
        return np.asarray(np.linalg.norm(inverse, axis=1) / norms)

    @staticmethod
    def steady(group: _Group, state: State) -> ComplexArray:
        """H U of a group."""
        problem = group.problem
        inputs = len(problem.inputs)
        columns = [mode * problem.width + k for mode in range(problem.modes) for k in range(2 * inputs)]
        end = problem.modes * problem.width
        columns += list(range(end, end + DIRECT_POWERS * inputs))
        return np.asarray(state.basis[:, columns] @ (state.coefficients[columns] * group.sigma))


def pole_covariance(fit: ProjectedFit, theta: FloatArray) -> FloatArray:
    """Covariance of theta that allows for noise of the excitation, which reaches all outputs through H.

    A lightly damped peak has too few lines to estimate their scatter. The variance predicted from the noise of the
    whole band is taken where it is the larger one.
    """
    jacobian, residual = fit.jacobian(theta), fit.residual(theta)
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    parameters = theta.size
    predicted, observed = np.zeros_like(inverse), np.zeros_like(inverse)
    start = 0
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        total, outputs = group.problem.total, len(group.sensors)
        part = slice(start, start + state.residual.size)
        start = part.stop
        own = jacobian[part].reshape(2, total, outputs, parameters)
        error = residual[part].reshape(2, total, outputs)
        scores = np.einsum("clop,clo->lp", own, error)
        observed += scores.T @ scores
        line = group.weight**2
        predicted += np.einsum("clop,cloq,l->pq", own, own, line, optimize=True)
        response = fit.steady(group, state) / np.sqrt(fit.input_power(group))[:, None]
        common = (group.weight * group.input_noise)[:, None] * response / group.sigma
        carried = np.einsum("lop,lo->lp", own[0] - 1j * own[1], common)
        predicted += 0.5 * (carried.real.T @ carried.real + carried.imag.T @ carried.imag)
    both = np.stack([inverse @ predicted @ inverse, inverse @ observed @ inverse])
    spread = np.sqrt(np.max(np.diagonal(both, axis1=1, axis2=2), axis=0))
    own_spread = np.sqrt(np.diag(both[0]))
    return np.asarray(both[0] * np.outer(spread / own_spread, spread / own_spread))


def _coherence(
    spectra: Sequence[RecordSpectrum],
    sensors: Sequence[Sensor],
    steady: Sequence[ComplexArray],
    measured: Sequence[ComplexArray],
    poles: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Return the share of each sensor's response near each peak that the excitation explains, shape (n, r)."""
    error, power = np.zeros((2, len(sensors), poles[0].size))
    omega = np.concatenate([item.omega for item in spectra])
    step = 6.0 * float(np.median(np.diff(omega)))
    for item, explained, seen in zip(spectra, steady, measured, strict=True):
        rows = [sensors.index(sensor) for sensor in item.sensors]
        for index, (peak, ratio) in enumerate(zip(*poles, strict=True)):
            near = np.abs(item.omega - peak) <= max(4.0 * ratio * peak, step)
            error[rows, index] += np.sum(np.abs(seen[near] - explained[near]) ** 2, axis=0)
            power[rows, index] += np.sum(np.abs(seen[near]) ** 2, axis=0)
    return np.asarray(np.clip(1.0 - error / np.maximum(power, 1e-300), 0.0, 1.0))


def fit_modes(
    spectra: Sequence[RecordSpectrum],
    angular_frequencies: FloatArray,
    damping_ratios: FloatArray,
    *,
    passes: int = 3,
    evaluations: int = 30,
    near: bool = False,
) -> MultiModeFit:
    """Fit the modes of all outputs of all tests together, from a first guess of the poles.

    Parameters
    ----------
    spectra
        Whole-record spectra, each test with the same outputs and the same place of excitation.
    angular_frequencies, damping_ratios
        First guess, shape (r,).
    passes
        Fits with weights renewed from the residuals of the one before.
    evaluations
        Bound on the evaluations of a pass.
    near
        The first pass has weights from the residuals of the guess; else strong peaks outweigh a mode without a peak.
    """
    order = np.argsort(angular_frequencies)
    guess = np.concatenate([np.log(angular_frequencies[order]), np.log(np.clip(damping_ratios[order], 1e-5, 0.3))])
    fit = ProjectedFit(spectra, angular_frequencies.size)
    if near:
        fit.renew_weights(guess)
    return collected(fit, spectra, fitted_poles(fit, guess, passes, evaluations))


def fitted_poles(fit: ProjectedFit, guess: FloatArray, passes: int, evaluations: int) -> FloatArray:
    """Return theta = (ln omega, ln zeta) at the least cost, weights renewed from pass to pass."""
    theta, modes = guess, guess.size // 2
    lower = np.concatenate([guess[:modes] - 0.03, np.full(modes, np.log(1e-6))])
    upper = np.concatenate([guess[:modes] + 0.03, np.full(modes, np.log(0.5))])
    for index in range(passes):
        result = least_squares(
            lambda t: fit.compressed(t)[:, -1],
            theta,
            jac=lambda t: fit.compressed(t)[:, :-1],
            bounds=(lower, upper),
            max_nfev=evaluations,
            x_scale="jac",
            xtol=1e-7,
            ftol=1e-7,
        )
        theta = np.asarray(result.x)
        if index < passes - 1:
            fit.renew_weights(theta)
    return theta


def collected(fit: ProjectedFit, spectra: Sequence[RecordSpectrum], theta: FloatArray) -> MultiModeFit:
    """Return the result of a fit with shared residues at theta, modes in rising order."""
    modes = theta.size // 2
    omega, zeta = np.exp(theta[:modes]), np.exp(theta[modes:])
    sensors, inputs = all_sensors(spectra), all_inputs(spectra)
    residues = np.full((len(sensors), len(inputs), modes), np.nan, dtype=np.complex128)
    steady, measured, transients = ([np.zeros_like(item.responses) for item in spectra] for _ in range(3))
    noise = np.empty(len(sensors))
    errors = np.full((len(sensors), len(inputs), modes), np.inf)
    for group, state in zip(fit.groups, fit.states(theta), strict=True):
        problem = group.problem
        own = [sensors.index(sensor) for sensor in group.sensors]
        raw = state.coefficients * group.sigma
        unit = fit.coefficient_errors(group, state)
        for number, place in enumerate(problem.inputs):
            column = inputs.index(place)
            for mode in range(modes):
                first = mode * problem.width + 2 * number
                # at the peak i omega/omega_r is i: the second coefficient turns the phase
                residues[own, column, mode] = raw[first] + 1j * raw[first + 1]
                errors[own, column, mode] = group.sigma * unit[first]
        noise[own] = 2.0 * group.sigma**2
        explained, rest = fit.steady(group, state), fit.complex_residual(group, state)
        start = 0
        for test in group.tests:
            part = slice(start, start + spectra[test].omega.size)
            columns = [spectra[test].sensors.index(sensor) for sensor in group.sensors]
            steady[test][:, columns] = explained[part]
            measured[test][:, columns] = explained[part] + rest[part]
            transients[test][:, columns] = group.target[part] - measured[test][:, columns]
            start = part.stop
    order = np.argsort(omega)
    both = np.concatenate([order, modes + order])
    residues, errors = residues[:, :, order], errors[:, :, order]
    shapes, shape_errors, participations = rank_one(residues, errors)
    return MultiModeFit(
        angular_frequencies=omega[order],
        damping_ratios=zeta[order],
        covariance=pole_covariance(fit, theta)[np.ix_(both, both)],
        residues=shapes,
        residue_errors=shape_errors,
        coherence=_coherence(spectra, sensors, steady, measured, (omega[order], zeta[order])),
        steady=tuple(steady),
        measured=tuple(measured),
        omega=tuple(item.omega for item in spectra),
        excitation=tuple(item.excitation for item in spectra),
        noise_variance=noise,
        sensors=sensors,
        inputs=inputs,
        participations=participations,
        input_residues=residues,
        spectra=tuple(spectra),
        transients=tuple(transients),
    )
