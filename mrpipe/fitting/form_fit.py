"""One base form fitted to bench tests from several starts, with covariance and parameters at bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.laws import law_names
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import DivergedError
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.engine import Fit, fit, linear_derivatives, start_of
from mrpipe.fitting.problem import Base, Problem
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.samples import blocks_of
from mrpipe.fitting.settings import DamperFitSettings
from mrpipe.fitting.solution import regressors, solve
from mrpipe.fitting.start import BEGUN_STEPS, MORE_POINTS, best_starts, first_problem, followed
from mrpipe.fitting.weighting import centred, weighting

NELDER_MEAD_ITERATIONS = 1000
NELDER_MEAD_ERROR = 0.01
"""Stopping rules of the thesis (section 2.2): at most 1000 iterations, RMS error accurate to 0.01 N."""


@dataclass(frozen=True)
class FormFit:
    """A fitted form.

    Attributes
    ----------
    fit
        The fit of the engine: problem, searched values, linear coefficients.
    model
        The damper.
    training_nrmse
        RMS error over RMS force at the samples of the fit, without the offsets of the tests [1].
    covariance
        Covariance of the parameters of the model, shape (p, p), in products of their units.
    names
        Names of the rows of the covariance.
    correlation
        Correlation of the parameters, shape (p, p), from the curvature of the squared error alone.
    at_bound
        Searched parameters that ended at a bound.
    start_nrmse
        NRMSE that each start ended at, the best first; it shows the spread over the starts.
    notes
        Messages for the user on how the form was fitted.
    """

    fit: Fit
    model: DamperModel
    training_nrmse: float
    covariance: FloatArray
    names: tuple[str, ...]
    correlation: FloatArray
    at_bound: tuple[str, ...] = ()
    start_nrmse: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def form(self) -> BaseForm:
        """The base form."""
        return self.fit.problem.base.form

    @property
    def values(self) -> dict[str, float]:
        """Searched parameters."""
        found = self.fit.base_values
        return {item.name: found[item.name] for item in self.fit.problem.base.parameters()}

    def standard_error(self, name: str) -> float:
        """Return the standard error of a parameter in the unit of the parameter; NaN if it was not fitted."""
        if name not in self.names:
            return float("nan")
        place = self.names.index(name)
        return float(np.sqrt(max(self.covariance[place, place], 0.0)))

    def correlated(self, limit: float = 0.95) -> list[tuple[str, str, float]]:
        """Return pairs of parameters whose absolute correlation exceeds `limit`, the largest first."""
        pairs = [
            (self.names[row], self.names[column], float(self.correlation[row, column]))
            for row in range(len(self.names))
            for column in range(row + 1, len(self.names))
            if abs(self.correlation[row, column]) > limit
        ]
        return sorted(pairs, key=lambda pair: -abs(pair[2]))


_SETTINGS = DamperFitSettings()
"""Source of the defaults, so that options and settings have the same ones."""


@dataclass(frozen=True)
class FitMethod:
    """Method and effort of the search of a form.

    Attributes
    ----------
    method
        `least-squares` (Levenberg-Marquardt) or `nelder-mead` (restarted from its result until the error no longer
        falls, as in section 2.2 of the thesis).
    starts
        Number of starting points, the best ones after a few steps, whose search is completed.
    iterations
        Largest number of steps of the search from each start.
    assumed_eta
        Rate of the lag of the drive [1/s] if the tests do not determine it.
    """

    method: str = _SETTINGS.method
    starts: int = _SETTINGS.starts
    iterations: int = 40
    assumed_eta: float = _SETTINGS.assumed_eta_per_s


def form_problem(
    recordings: Recordings, base: Base, *, offsets: bool = True, weights: FloatArray | None = None
) -> Problem:
    """Return the problem of one form.

    Parameters
    ----------
    recordings
        Concatenated tests.
    base
        Base form.
    offsets
        Whether each test has its own force offset; otherwise all tests share one.
    weights
        Factor on the error of each sample, shape (n,); 1 if None.
    """
    problem = first_problem(recordings, base)
    root = problem.root_weight if weights is None else problem.root_weight * weights
    return replace(problem, root_weight=root, offsets=offsets)


def fit_form(
    problem: Problem, method: FitMethod = FitMethod(), *, drive_unit: str, warm: Mapping[str, float] | None = None
) -> FormFit:
    """Fit one form.

    Parameters
    ----------
    problem
        See :func:`form_problem`.
    method
        Optimiser.
    drive_unit
        A or V.
    warm
        Parameters to start from instead of the starts of the form.

    Raises
    ------
    DivergedError
        If the force of the model is not finite at the result.
    """
    begins = [start_of(problem, warm, [])] if warm is not None else _begins(problem, method)
    ends = []
    for begin in begins:
        if len(begin) and method.method == "nelder-mead":
            ends.append(_nelder_mead(problem, begin))
        else:
            ends.append(fit(problem, begin, iterations=method.iterations, tolerance=1e-7))
    ends.sort(key=lambda item: item.cost)
    return form_fit(ends[0], method, drive_unit, tuple(nrmse_of(end) for end in ends))


def _begins(problem: Problem, method: FitMethod) -> list[FloatArray]:
    if method.method == "nelder-mead":
        return best_starts(problem, method.starts)
    points = best_starts(problem, MORE_POINTS * method.starts)
    return [item.theta for item in followed(problem, points, method.starts, BEGUN_STEPS)]


def form_fit(found: Fit, method: FitMethod, drive_unit: str, start_nrmse: tuple[float, ...] = ()) -> FormFit:
    """Return a fit with its covariance and its damper."""
    problem = found.problem
    if not np.all(np.isfinite(found.residual)) or not np.any(found.linear):
        raise DivergedError(f"fit of {problem.base.name}: the model's force is not finite; narrow the bounds")
    names, matrix = parameter_names(found)
    covariance, correlation = _uncertainty(found, matrix)
    low, high = problem.bounds() if len(found.theta) else (np.zeros(0), np.zeros(0))
    margin = 1e-3 * (high - low)
    bound = tuple(
        parameter.name
        for (_, parameter), t, a, b, m in zip(problem.searched, found.theta, low, high, margin, strict=True)
        if not a + m < t < b - m
    )
    return FormFit(
        fit=found,
        model=damper_model(found, drive_unit, assumed_eta=method.assumed_eta),
        training_nrmse=nrmse_of(found),
        covariance=covariance,
        names=names,
        correlation=correlation,
        at_bound=bound,
        start_nrmse=start_nrmse or (nrmse_of(found),),
    )


def parameter_names(found: Fit) -> tuple[tuple[str, ...], FloatArray]:
    """Return the names of the model parameters, and the matrix that maps searched and linear numbers to them.

    The matrix converts coefficients in the basis of the laws to the numbers of the laws, and keeps all others.
    """
    base, problem = found.problem.base, found.problem
    names = [parameter.name for _, parameter in problem.searched]
    blocks = [np.eye(len(names))]
    drive = problem.scales.drive
    scales = base.scale_shares(found.base_values, drive)
    for block, shape, law, scale in zip(base.form.blocks, base.laws, found.laws, scales, strict=True):
        names += law_names(block, law)[: shape.count]
        blocks.append(shape.matrix(drive, scale))
    names += [parameter.name for _, parameter in problem.amplitudes]
    blocks.append(np.eye(len(problem.amplitudes)))
    return tuple(names), block_diagonal(blocks)


def block_diagonal(blocks: list[FloatArray]) -> FloatArray:
    """Return the block-diagonal matrix of square matrices."""
    size = sum(len(block) for block in blocks)
    matrix = np.zeros((size, size))
    row = 0
    for block in blocks:
        matrix[row : row + len(block), row : row + len(block)] = block
        row += len(block)
    return matrix


def nrmse_of(found: Fit) -> float:
    """Return RMS weighted residual over RMS weighted force of a fit, both without the offset of each test."""
    force = weighting(found.problem).target
    return float(np.sqrt(found.cost / max(float(force @ force), 1e-300)))


def _nelder_mead(problem: Problem, begin: FloatArray) -> Fit:
    w = weighting(problem)
    low, high = problem.bounds()
    size = float(np.linalg.norm(w.target))
    rms = float(np.sqrt(np.mean(problem.recordings.force[w.at] ** 2)))
    error = NELDER_MEAD_ERROR / rms
    options = {"maxiter": NELDER_MEAD_ITERATIONS, "fatol": 0.01 * error, "xatol": 1e-4}

    def cost(share: FloatArray) -> float:
        return float(np.sqrt(solve(problem, low + share * (high - low), w).cost)) / size

    end, best = (begin - low) / (high - low), np.inf
    for _ in range(10):
        found = minimize(cost, end, method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(begin), options=options)
        end = found.x
        if best - found.fun < error:
            break
        best = found.fun
    theta = low + np.asarray(end) * (high - low)
    return fit(problem, theta, iterations=0)


def _uncertainty(found: Fit, matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return covariance and correlation of the model's parameters.

    The residual of a model is not white noise. The covariance is therefore the sandwich estimate over parts of the
    recordings, within which errors are correlated. The correlation follows from the curvature alone.
    """
    problem = found.problem
    w = weighting(problem)
    residual = found.residual[w.at]
    unweighted = regressors(problem, found.theta)
    columns = centred(unweighted, w)[0]
    calculated = found.linear @ columns
    values = problem.decode(found.theta)
    slopes = []
    for place, value in enumerate(values):
        step = 1e-4 * (abs(value) or problem.scales.of(problem.searched[place][1].scale))
        theta = problem.encode([*values[:place], value + step, *values[place + 1 :]])
        moved = centred(regressors(problem, theta), w)[0]
        slopes.append((found.linear @ moved - calculated) / step)
    free = -linear_derivatives(found, unweighted)
    if problem.base.form.known:
        free = np.delete(free, problem.base.columns - 1, axis=0)
    # the rows are derivatives of the model force, not of the residual: the sign cancels in both products below
    jacobian = np.linalg.inv(matrix).T @ np.vstack([*slopes, free])
    size = np.linalg.norm(jacobian, axis=1)
    size[size == 0.0] = 1.0
    jacobian /= size[:, None]
    inverse = np.linalg.pinv(jacobian @ jacobian.T, rcond=1e-13, hermitian=True)
    _, block = np.unique(blocks_of(problem.recordings)[w.at], return_inverse=True)
    scores = np.stack([np.bincount(block, weights=row * residual) for row in jacobian])
    blocks = scores.shape[1]
    meat = scores @ scores.T * (blocks / max(blocks - 1, 1))
    deviation = np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    covariance = inverse @ meat @ inverse / np.outer(size, size)
    return covariance, inverse / np.outer(deviation, deviation)
