"""Levenberg-Marquardt with the stopping rules of MATLAB's trainlm.

Four methods share the rules: scipy's `least_squares` with a trust region on the exactly compressed problem, the same
function with MINPACK's method `lm` on all rows, and a loop of this program with the damping mu I of trainlm or
mu diag(J'J) of Marquardt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray
from mrpipe.networks.problem import Problem
from mrpipe.networks.stopping import StoppingRules

Method = Literal["least-squares", "minpack", "mu-identity", "mu-diagonal"]


@dataclass(frozen=True)
class FitResult:
    """Result of a training run.

    Attributes
    ----------
    parameters
        Parameters with the smallest error on the held-out rows; without held-out rows, the last parameters.
    mean_square, held_out_mean_square
        Mean squared normalised error at `parameters` on the training rows and on the held-out rows (NaN without
        held-out rows).
    iterations
        Number of accepted steps.
    reason
        Reason why the run ended.
    path
        Mean squared error at the start and after each step.
    """

    parameters: FloatArray
    mean_square: float
    held_out_mean_square: float
    iterations: int
    reason: str
    path: tuple[float, ...]


class _Stop(Exception):
    """Exception that ends the loop of scipy; it carries the reason."""


class _Watch:
    """Records the path and the best parameters, and applies the stopping rules."""

    def __init__(self, held_out: Problem | None, rules: StoppingRules) -> None:
        self.held_out = held_out
        self.rules = rules
        self.path: list[float] = []
        self.best_error = np.inf
        self.best: tuple[FloatArray, float] | None = None
        self.failures = 0

    def accepted(self, parameters: FloatArray, mean_square: float, gradient: FloatArray) -> str:
        """Record an accepted step; return the reason to stop, or an empty string."""
        self.path.append(mean_square)
        error = self.held_out.mean_square(parameters) if self.held_out is not None else mean_square
        if error < self.best_error or self.best is None:
            self.best_error, self.best, self.failures = error, (parameters.copy(), mean_square), 0
        else:
            self.failures += 1
        rules = self.rules
        if self.held_out is not None and self.failures >= rules.held_out_failures:
            return "held-out failures"
        if float(np.max(np.abs(gradient))) < rules.gradient:
            return "gradient"
        if len(self.path) > 10 and self.path[-11] - mean_square < rules.improvement * self.path[-11]:
            return "improvement"
        return "iterations" if len(self.path) > rules.iterations else ""

    def result(self, reason: str) -> FitResult:
        """Return the best parameters of the run."""
        assert self.best is not None
        parameters, mean_square = self.best
        held_out = self.best_error if self.held_out is not None else float("nan")
        return FitResult(parameters, mean_square, held_out, len(self.path) - 1, reason, tuple(self.path))


def fit(
    problem: Problem,
    start: FloatArray,
    *,
    method: Method = "least-squares",
    rules: StoppingRules | None = None,
    held_out: Problem | None = None,
) -> FitResult:
    """Minimise the mean squared error of a network.

    Parameters
    ----------
    problem
        Training rows.
    start
        Initial parameters, shape (P,).
    method
        `least-squares` (scipy, trust region, scaled by the Jacobian), `minpack` (scipy's `least_squares` with method
        `lm` on all rows), `mu-identity` (trainlm) or `mu-diagonal`.
    rules
        Stopping rules.
    held_out
        Rows of other records for early stopping. These are never the rows on which the final model is assessed.
    """
    watch = _Watch(held_out, rules or StoppingRules())
    if method == "least-squares":
        return watch.result(_scipy_loop(problem, start, watch))
    if method == "minpack":
        return watch.result(_minpack_loop(problem, start, watch))
    return watch.result(_own_loop(problem, start, watch, identity=method == "mu-identity"))


def _scipy_loop(problem: Problem, start: FloatArray, watch: _Watch) -> str:
    latest: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def compressed(parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = parameters.tobytes()
        if key not in latest:
            latest.clear()
            latest[key] = problem.compressed(parameters)
        return latest[key]

    def jacobian(parameters: FloatArray) -> FloatArray:
        # least_squares evaluates the Jacobian once per step, after accepting the step
        residual, matrix = compressed(parameters)
        reason = watch.accepted(parameters, float(residual @ residual), 2.0 * matrix.T @ residual)
        if reason:
            raise _Stop(reason)
        return matrix

    try:
        outcome = least_squares(
            lambda parameters: compressed(parameters)[0],
            start,
            jac=jacobian,
            method="trf",
            x_scale="jac",
            ftol=1e-12,
            xtol=1e-10,
            gtol=None,
            max_nfev=20 * watch.rules.iterations,
        )
    except _Stop as stop:
        return str(stop)
    return "step" if outcome.status in {2, 3, 4} else "evaluations"


def _minpack_loop(problem: Problem, start: FloatArray, watch: _Watch) -> str:
    """Run MINPACK's lmder on the residuals of all rows; it evaluates the Jacobian once for each accepted step."""
    root = 1.0 / math.sqrt(problem.rows)
    penalty = math.sqrt(problem.weight_decay)

    def residual(parameters: FloatArray) -> FloatArray:
        rows = root * problem.residual(parameters)
        return np.concatenate([rows, penalty * parameters]) if penalty > 0.0 else rows

    def jacobian(parameters: FloatArray) -> FloatArray:
        matrix = root * problem.jacobian(parameters)
        if penalty > 0.0:
            matrix = np.vstack([matrix, penalty * np.eye(problem.size)])
        error = residual(parameters)
        reason = watch.accepted(parameters, float(error @ error), 2.0 * matrix.T @ error)
        if reason:
            raise _Stop(reason)
        return matrix

    try:
        outcome = least_squares(
            residual,
            start,
            jac=jacobian,
            method="lm",
            x_scale="jac",
            ftol=1e-12,
            xtol=1e-10,
            gtol=1e-12,
            max_nfev=20 * watch.rules.iterations,
        )
    except _Stop as stop:
        return str(stop)
    return "evaluations" if outcome.status == 0 else "step"


def _own_loop(problem: Problem, start: FloatArray, watch: _Watch, *, identity: bool) -> str:
    rules = watch.rules
    parameters = np.array(start, dtype=np.float64)
    mu = rules.mu
    while True:
        gram = problem.gram(parameters)
        curvature, gradient = gram[:-1, :-1], gram[:-1, -1]
        # trials are compared in double precision
        mean_square = problem.mean_square(parameters) if problem.single else float(gram[-1, -1])
        reason = watch.accepted(parameters, mean_square, 2.0 * gradient)
        if reason:
            return reason
        diagonal = np.diag(curvature)
        # a parameter without effect still needs some damping
        scale = np.ones(len(diagonal)) if identity else np.maximum(diagonal, 1e-12 * diagonal.max())
        while True:
            trial = parameters + _step(curvature, gradient, mu * scale)
            if problem.mean_square(trial) < mean_square:
                parameters, mu = trial, max(mu * rules.mu_decrease, 1e-20)
                break
            mu *= rules.mu_increase
            if mu > rules.mu_maximum:
                return "mu"


def _step(curvature: FloatArray, gradient: FloatArray, damping: FloatArray) -> FloatArray:
    damped = curvature + np.diag(damping)
    try:
        return -np.asarray(cho_solve(cho_factor(damped, check_finite=False), gradient, check_finite=False))
    except LinAlgError:
        return -np.asarray(np.linalg.lstsq(damped, gradient, rcond=None)[0])
