"""Variable projection over groups of sensors that share a linear basis, with weights renewed from the residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.projection import DIRECT_POWERS, Problem, State, evaluate, stack
from mrpipe.modal.records import Sensor
from mrpipe.modal.spectra import ComplexArray, RecordSpectrum, all_sensors


@dataclass
class _Group:
    """Sensors of one kind that occur in the same tests, so that they have the same linear basis."""

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

    With `separate`, each test has separate residues; else the residues of a sensor are common to all tests.
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
        """Return the triangle R of [J e], a problem of few rows with exactly the same norm, gradient and J'J."""
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
        """Estimate the weights again from the residuals, because the peaks amplify noise of the excitation.

        The variance is s_y2 + |H|2 s_u2.
        """
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
        """Return the squared magnitude of the inputs over their scales, in the unit of the first, shape (rows,)."""
        scale = group.problem.scale
        power = np.sum(np.abs(np.concatenate(group.problem.excitations) / scale) ** 2, axis=1) * scale[0] ** 2
        return np.asarray(np.maximum(power, 1e-300))

    @staticmethod
    def complex_residual(group: _Group, state: State) -> ComplexArray:
        """Return the residual of a group in the unit of its spectra."""
        return group.target - state.basis @ (state.coefficients * group.sigma)

    @staticmethod
    def coefficient_errors(group: _Group, state: State) -> FloatArray:
        """Return the standard errors of the coefficients of a group for responses of unit noise, shape (columns,)."""
        weight = np.concatenate([group.weight, group.weight])
        weighted = stack(state.basis) * weight[:, None]
        norms = np.maximum(np.linalg.norm(weighted, axis=0), 1e-300)
        inverse = np.linalg.pinv(np.linalg.qr(weighted / norms, mode="r"))
        return np.asarray(np.linalg.norm(inverse, axis=1) / norms)

    @staticmethod
    def steady(group: _Group, state: State) -> ComplexArray:
        """Return the steady response H U of a group."""
        problem = group.problem
        inputs = len(problem.inputs)
        columns = [mode * problem.width + k for mode in range(problem.modes) for k in range(2 * inputs)]
        end = problem.modes * problem.width
        columns += list(range(end, end + DIRECT_POWERS * inputs))
        return np.asarray(state.basis[:, columns] @ (state.coefficients[columns] * group.sigma))
