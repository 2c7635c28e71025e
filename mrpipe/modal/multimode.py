"""Multi-mode fit of whole-record spectra with leakage modelled: poles by variable projection, the rest linear.

In a record of finite length the spectrum of a response is exactly Y = H U + T, where T holds what the modes carried
over the record's beginning and end and has the poles of H. Frames damped by a tenth of a per cent ring for longer than
a test lasts, so T is as large as H U at the peaks; averaging with windows would smear both into too much damping.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray
from mrpipe.modal.projection import DIRECT_POWERS, Problem, State, evaluate, stack
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum


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
        Shape (n, r) complex: amplitude of mode r on floor i in acceleration over excitation, its phase referred to
        that of a proportionally damped frame (0 or pi).
    residue_errors
        Shape (n, r): standard error of the residues by the responses' noise; noise of the excitation scales a mode's
        residues alike and leaves its shape.
    coherence
        Shape (n, r): share of the response near the peak that the excitation and the record's ends explain.
    steady, measured
        One entry a test, shape (m, n): H U of the fit, and the measured response without its transient part.
    omega
        One entry a test, shape (m,) [rad/s].
    excitation
        One entry a test, shape (m,).
    noise_variance
        Shape (n,): variance of a spectral line far from the peaks.
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
        )

    def residual(self) -> ComplexArray:
        """What neither excitation nor transients explain, all tests after one another, shape (sum m, n)."""
        return np.vstack([m - s for m, s in zip(self.measured, self.steady, strict=True)])


def _group_target(spectra: Sequence[RecordSpectrum], outputs: Sequence[int]) -> ComplexArray:
    return np.vstack([item.responses[:, outputs] for item in spectra])


class _Fit:
    """Variable projection over the outputs of both kinds, with weights renewed from the residuals."""

    def __init__(self, spectra: Sequence[RecordSpectrum], modes: int) -> None:
        kinds = spectra[0].is_displacement
        self.groups = [
            (Problem(spectra, modes, flag), [i for i, d in enumerate(kinds) if d is flag])
            for flag in (False, True)
            if flag in kinds
        ]
        self.smooth = [problem.smooth_columns() for problem, _ in self.groups]
        self.targets = [_group_target(spectra, outputs) for _, outputs in self.groups]
        self.sigma = [np.std(target, axis=0) for target in self.targets]
        self.weight = [np.ones(problem.total) for problem, _ in self.groups]
        self.input_noise = [0.0 for _ in self.groups]
        self._cache: tuple[bytes, list[State]] | None = None

    def states(self, theta: FloatArray) -> list[State]:
        key = theta.tobytes()
        if self._cache is None or self._cache[0] != key:
            states = []
            for (problem, _), smooth, target, sigma, weight in zip(
                self.groups, self.smooth, self.targets, self.sigma, self.weight, strict=True
            ):
                both = np.concatenate([weight, weight])
                states.append(evaluate(problem, smooth, theta, stack(target / sigma) * both[:, None], both))
            self._cache = (key, states)
        return self._cache[1]

    def residual(self, theta: FloatArray) -> FloatArray:
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
        return np.vstack([state.jacobian for state in self.states(theta)])

    def renew_weights(self, theta: FloatArray) -> None:
        """Noise of the excitation is amplified at the peaks: variance = s_y2 + |H|2 s_u2, estimated from residuals."""
        states = self.states(theta)
        for index, ((problem, outputs), state) in enumerate(zip(self.groups, states, strict=True)):
            unweighted = self.complex_residual(index, state)
            direct = self.steady(index, state)
            response = (
                np.abs(direct) ** 2 / np.abs(np.concatenate([s.excitation for s in problem.spectra]))[:, None] ** 2
            )
            total = np.zeros(problem.total)
            noise = []
            for column in range(len(outputs)):
                power = np.abs(unweighted[:, column]) ** 2
                quiet = response[:, column] <= np.median(response[:, column])
                floor = max(float(np.mean(power[quiet])), 1e-300)
                loud = response[:, column] >= np.quantile(response[:, column], 0.97)
                amplified = max(float(np.mean(power[loud]) - floor), 0.0) / float(np.mean(response[loud, column]))
                self.sigma[index][column] = np.sqrt(floor / 2.0)
                noise.append(amplified)
                total = np.maximum(total, amplified * response[:, column] / floor)
            self.weight[index] = 1.0 / np.sqrt(1.0 + total)
            self.input_noise[index] = float(np.sqrt(np.median(noise)))
        self._cache = None

    def complex_residual(self, index: int, state: State) -> ComplexArray:
        """Residual of a group in the unit of its spectra."""
        return self.targets[index] - state.basis @ (state.coefficients * self.sigma[index])

    def coefficient_errors(self, index: int, state: State) -> FloatArray:
        """Standard errors of a group's coefficients for responses of unit noise, shape (columns,)."""
        weight = np.concatenate([self.weight[index], self.weight[index]])
        weighted = stack(state.basis) * weight[:, None]
        norms = np.linalg.norm(weighted, axis=0)
        inverse = np.linalg.pinv(np.linalg.qr(weighted / norms, mode="r"))
        return np.asarray(np.linalg.norm(inverse, axis=1) / norms)

    def steady(self, index: int, state: State) -> ComplexArray:
        """H U of a group."""
        problem = self.groups[index][0]
        width = 2 + 2 * problem.tests
        columns = [m * width + k for m in range(problem.modes) for k in (0, 1)]
        columns += list(range(problem.modes * width, problem.modes * width + DIRECT_POWERS))
        return state.basis[:, columns] @ (state.coefficients[columns] * self.sigma[index])


def _covariance(fit: _Fit, theta: FloatArray) -> FloatArray:
    """Covariance of theta that allows for noise of the excitation, which reaches all outputs alike through H.

    A lightly damped peak holds only a few lines, too few to tell their own scatter; so the variance of what the model
    predicts from the noise found over the whole band is taken where it is the larger one.
    """
    jacobian, residual = fit.jacobian(theta), fit.residual(theta)
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    parameters = theta.size
    predicted, observed = np.zeros_like(inverse), np.zeros_like(inverse)
    start = 0
    for index, ((problem, outputs), state) in enumerate(zip(fit.groups, fit.states(theta), strict=True)):
        part = slice(start, start + state.residual.size)
        start = part.stop
        own = jacobian[part].reshape(2, problem.total, len(outputs), parameters)
        error = residual[part].reshape(2, problem.total, len(outputs))
        scores = np.einsum("clop,clo->lp", own, error)
        observed += scores.T @ scores
        line = fit.weight[index] ** 2
        predicted += np.einsum("clop,cloq,l->pq", own, own, line, optimize=True)
        response = fit.steady(index, state) / np.concatenate([s.excitation for s in problem.spectra])[:, None]
        common = (fit.weight[index] * fit.input_noise[index])[:, None] * response / fit.sigma[index]
        carried = np.einsum("lop,lo->lp", own[0] - 1j * own[1], common)
        predicted += 0.5 * (carried.real.T @ carried.real + carried.imag.T @ carried.imag)
    both = np.stack([inverse @ predicted @ inverse, inverse @ observed @ inverse])
    spread = np.sqrt(np.max(np.diagonal(both, axis1=1, axis2=2), axis=0))
    own_spread = np.sqrt(np.diag(both[0]))
    return np.asarray(both[0] * np.outer(spread / own_spread, spread / own_spread))


def _coherence(
    omega: FloatArray, steady: ComplexArray, measured: ComplexArray, peaks: FloatArray, zeta: FloatArray
) -> FloatArray:
    result = np.empty((measured.shape[1], peaks.size))
    for index, (peak, ratio) in enumerate(zip(peaks, zeta, strict=True)):
        half = max(4.0 * ratio * peak, 6.0 * float(np.median(np.diff(omega))))
        near = np.abs(omega - peak) <= half
        error = np.sum(np.abs(measured[near] - steady[near]) ** 2, axis=0)
        power = np.maximum(np.sum(np.abs(measured[near]) ** 2, axis=0), 1e-300)
        result[:, index] = np.clip(1.0 - error / power, 0.0, 1.0)
    return result


def fit_modes(
    spectra: Sequence[RecordSpectrum],
    angular_frequencies: FloatArray,
    damping_ratios: FloatArray,
    *,
    passes: int = 3,
    evaluations: int = 30,
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
    """
    order = np.argsort(angular_frequencies)
    guess = np.concatenate([np.log(angular_frequencies[order]), np.log(np.clip(damping_ratios[order], 1e-5, 0.3))])
    modes = angular_frequencies.size
    fit = _Fit(spectra, modes)
    theta = guess
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
    return _collect(fit, spectra, theta)


def _collect(fit: _Fit, spectra: Sequence[RecordSpectrum], theta: FloatArray) -> MultiModeFit:
    modes = theta.size // 2
    omega, zeta = np.exp(theta[:modes]), np.exp(theta[modes:])
    outputs = spectra[0].responses.shape[1]
    total = sum(item.omega.size for item in spectra)
    residues = np.empty((outputs, modes), dtype=np.complex128)
    steady, measured = (np.empty((total, outputs), dtype=np.complex128) for _ in range(2))
    noise = np.empty(outputs)
    errors = np.empty((outputs, modes))
    for index, ((problem, own), state) in enumerate(zip(fit.groups, fit.states(theta), strict=True)):
        width = 2 + 2 * problem.tests
        raw = state.coefficients * fit.sigma[index]
        for mode in range(modes):
            # at the peak i omega/omega_r is i: the second coefficient turns the phase
            residues[own, mode] = raw[mode * width] + 1j * raw[mode * width + 1]
        unit = fit.coefficient_errors(index, state)[[mode * width for mode in range(modes)]]
        errors[own] = np.outer(fit.sigma[index], unit)
        steady[:, own] = fit.steady(index, state)
        measured[:, own] = steady[:, own] + fit.complex_residual(index, state)
        noise[own] = 2.0 * fit.sigma[index] ** 2
    edges = np.cumsum([item.omega.size for item in spectra])[:-1]
    line = np.concatenate([item.omega for item in spectra])
    both = np.concatenate([order := np.argsort(omega), modes + order])
    return MultiModeFit(
        angular_frequencies=omega[order],
        damping_ratios=zeta[order],
        covariance=_covariance(fit, theta)[np.ix_(both, both)],
        residues=residues[:, order],
        residue_errors=errors[:, order],
        coherence=_coherence(line, steady, measured, omega[order], zeta[order]),
        steady=tuple(np.split(steady, edges)),
        measured=tuple(np.split(measured, edges)),
        omega=tuple(item.omega for item in spectra),
        excitation=tuple(item.excitation for item in spectra),
        noise_variance=noise,
    )
