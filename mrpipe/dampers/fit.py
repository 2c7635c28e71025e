"""Fitting one form: least squares with the linear coefficients projected out, or Nelder-Mead with restarts.

The nonlinear parameters are searched as logarithms or as shares of their range; for each trial the best linear
coefficients, none of them negative in Bernstein's basis, follow from the normal equations. An offset a test is
projected out with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import OptimizeResult, least_squares, minimize, nnls

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import Form, NonlinearParameter, Scales
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.samples import FitData
from mrpipe.errors import DivergedError

NELDER_MEAD_ITERATIONS = 1000
NELDER_MEAD_ERROR = 0.01
"""The thesis' stopping rules (section 2.2): at most 1000 iterations, an RMS error known to 0.01 N."""


@dataclass(frozen=True)
class FormFit:
    """A fitted form.

    Attributes
    ----------
    form
        The form.
    scales
        What its guesses and orders followed from.
    values
        Nonlinear parameters.
    linear
        Coefficients of the form's columns (Bernstein basis).
    model
        The damper.
    training_nrmse
        RMS error over RMS force at the samples of the fit, offsets projected out.
    covariance
        Shape (p, p), of the model's parameters.
    names
        Names of its rows.
    correlation
        Shape (p, p), from the curvature alone.
    at_bound
        Nonlinear parameters that ended at a bound.
    start_nrmse
        What each start ended at, best first: the spread over starts.
    evaluations
        Trials of the model.
    notes
        What the user should know of how it was fitted.
    """

    form: Form
    scales: Scales
    values: dict[str, float]
    linear: FloatArray
    model: DamperModel
    training_nrmse: float
    covariance: FloatArray
    names: tuple[str, ...]
    correlation: FloatArray
    at_bound: tuple[str, ...] = ()
    start_nrmse: tuple[float, ...] = field(default_factory=tuple)
    evaluations: int = 0
    notes: tuple[str, ...] = ()

    def standard_error(self, name: str) -> float:
        """Return the standard error of a parameter in its own unit; not a number where it was not searched."""
        if name not in self.names:
            return float("nan")
        place = self.names.index(name)
        return float(np.sqrt(max(self.covariance[place, place], 0.0)))

    def correlated(self, limit: float = 0.95) -> list[tuple[str, str, float]]:
        """Return pairs of parameters whose correlation is above `limit` in size, the closest first."""
        pairs = [
            (self.names[row], self.names[column], float(self.correlation[row, column]))
            for row in range(len(self.names))
            for column in range(row + 1, len(self.names))
            if abs(self.correlation[row, column]) > limit
        ]
        return sorted(pairs, key=lambda pair: -abs(pair[2]))


class Projection:
    """The fit of one form to one set of samples as a function of the nonlinear parameters alone."""

    def __init__(self, form: Form, scales: Scales, data: FitData, *, offsets: bool, weights: FloatArray | None) -> None:
        self.form, self.scales, self.data = form, scales, data
        self.parameters = form.parameters(scales)
        self.evaluations = 0
        self._weights = weights
        self._offsets = offsets
        _, self._group = np.unique(data.test, return_inverse=True)
        self._count = np.bincount(self._group, weights=None if weights is None else weights**2)
        self.force = self._reduce(data.force[None, :].copy())[0]
        self.rms_force = float(np.sqrt(np.mean(self.force**2)))

    def _reduce(self, rows: FloatArray) -> FloatArray:
        """Take the (weighted) mean of every test out of rows of shape (k, m) and weight them, all in place."""
        if self._offsets:
            square = None if self._weights is None else self._weights**2
            for row in rows:
                total = np.bincount(self._group, weights=row if square is None else row * square)
                row -= (total / self._count)[self._group]
        if self._weights is not None:
            rows *= self._weights
        return rows

    def values(self, searched: FloatArray) -> dict[str, float]:
        """Return parameters from the numbers that the search moves, all of them in 0..1."""
        return {p.name: _from_unit(p, float(number)) for p, number in zip(self.parameters, searched, strict=True)}

    def searched(self, values: dict[str, float]) -> FloatArray:
        """Return the inverse of :meth:`values`."""
        return np.array([_to_unit(p, values[p.name]) for p in self.parameters])

    def columns(self, values: dict[str, float]) -> tuple[FloatArray, FloatArray]:
        """Return the reduced columns, shape (k, m), and the reduced force that they must explain, (m,)."""
        self.evaluations += 1
        regressors = self.form.regressors(values, self.data.motion, self.scales, self.data.at)
        columns = self._reduce(regressors.columns)
        if regressors.known is None:
            return columns, self.force
        return columns, self.force - self._reduce(regressors.known[None, :].copy())[0]

    def solve(self, values: dict[str, float]) -> tuple[FloatArray, FloatArray]:
        """Return (linear coefficients, residual [N])."""
        columns, target = self.columns(values)
        linear = _non_negative(columns, target)
        return linear, target - linear @ columns

    def residual(self, searched: FloatArray) -> FloatArray:
        """Return the residual over the RMS force, so that its RMS is the NRMSE, shape (m,)."""
        residual = self.solve(self.values(searched))[1]
        if not np.all(np.isfinite(residual)):
            raise DivergedError(f"fit of {self.form.name}: the model's force is not finite; narrow the bounds")
        return residual / (self.rms_force * np.sqrt(len(residual)))

    def nrmse(self, searched: FloatArray) -> float:
        """Return the NRMSE."""
        return float(np.linalg.norm(self.residual(searched)))


def _from_unit(parameter: NonlinearParameter, number: float) -> float:
    low, high = parameter.lower, parameter.upper
    if parameter.logarithmic:
        return float(low * (high / low) ** number)
    return float(low + (high - low) * number)


def _to_unit(parameter: NonlinearParameter, value: float) -> float:
    low, high = parameter.lower, parameter.upper
    share = np.log(value / low) / np.log(high / low) if parameter.logarithmic else (value - low) / (high - low)
    return float(min(max(share, 0.0), 1.0))


def _non_negative(columns: FloatArray, target: FloatArray) -> FloatArray:
    """Return the least-squares coefficients, none below zero, by way of the normal equations (scaled columns)."""
    size = np.sqrt(np.einsum("ij,ij->i", columns, columns))
    size[size == 0.0] = 1.0
    gram = (columns @ columns.T) / np.outer(size, size)
    right = columns @ target / size
    # the root turns the normal equations back into a small least-squares problem with the same answer
    values, vectors = np.linalg.eigh(gram)
    kept = values > 1e-12 * values[-1]
    root = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    small = (vectors[:, kept].T @ right) / np.sqrt(values[kept])
    solution = np.linalg.lstsq(root, small, rcond=None)[0]
    if np.any(solution < 0.0):
        solution = nnls(root, small)[0]
    return np.asarray(solution / size, dtype=np.float64)


def fit_form(
    form: Form,
    data: FitData,
    scales: Scales,
    *,
    method: str = "least-squares",
    starts: int = 3,
    offsets: bool = True,
    weights: FloatArray | None = None,
    warm: dict[str, float] | None = None,
    maximum_evaluations: int = 60,
) -> FormFit:
    """Fit one form.

    Parameters
    ----------
    form, data, scales
        What to fit to what.
    method
        `least-squares` (trust region, several starts) or `nelder-mead` (restarted from where it ended until it gains
        nothing, as in section 2.2 of the thesis).
    starts
        How many of the form's starts, the best at first sight, are followed to the end.
    offsets
        Project out an offset a test.
    weights
        Weight of each sample, shape (m,); all 1 where None.
    warm
        Nonlinear parameters to start from in place of the form's own starts.
    maximum_evaluations
        Steps of the trust region a start.

    Raises
    ------
    DivergedError
        If the model's force is not finite for some trial.
    """
    problem = Projection(form, scales, data, offsets=offsets, weights=weights)
    begins = [problem.searched(warm)] if warm is not None else first_points(problem, starts)
    ends: list[tuple[float, FloatArray]] = []
    for begin in begins:
        if len(begin) == 0:
            end = begin
        elif method == "nelder-mead":
            end = _nelder_mead(problem, begin)
        else:
            end = _trust_region(problem, begin, maximum_evaluations).x
        ends.append((problem.nrmse(end), end))
    ends.sort(key=lambda item: item[0])
    return _result(problem, ends)


def first_points(problem: Projection, count: int) -> list[FloatArray]:
    """Return the `count` best of the combinations of the parameters' starts."""
    axes = [[_to_unit(p, start) for start in p.starts] for p in problem.parameters]
    if not axes:
        return [np.zeros(0)]
    grid = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)
    order = np.argsort([problem.nrmse(point) for point in grid], kind="stable")
    return [grid[place] for place in order[:count]]


def _trust_region(problem: Projection, begin: FloatArray, maximum_evaluations: int) -> OptimizeResult:
    inside = np.clip(begin, 1e-4, 1.0 - 1e-4)
    return least_squares(
        problem.residual,
        inside,
        bounds=(0.0, 1.0),
        diff_step=1e-5,
        ftol=1e-7,
        xtol=1e-7,
        gtol=1e-9,
        max_nfev=maximum_evaluations,
    )


def _nelder_mead(problem: Projection, begin: FloatArray) -> FloatArray:
    error = NELDER_MEAD_ERROR / problem.rms_force
    options = {"maxiter": NELDER_MEAD_ITERATIONS, "fatol": 0.01 * error, "xatol": 1e-4}
    end, best = begin, np.inf
    for _ in range(10):
        found = minimize(problem.nrmse, end, method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(begin), options=options)
        end = found.x
        if best - found.fun < error:
            break
        best = found.fun
    return np.asarray(end, dtype=np.float64)


def _result(problem: Projection, ends: Sequence[tuple[float, FloatArray]]) -> FormFit:
    nrmse, searched = ends[0]
    form, scales = problem.form, problem.scales
    values = problem.values(searched)
    linear, residual = problem.solve(values)
    covariance, correlation = _uncertainty(problem, values, linear, residual)
    bound = tuple(
        p.name for p, number in zip(problem.parameters, searched, strict=True) if not 1e-3 < number < 1 - 1e-3
    )
    return FormFit(
        form=form,
        scales=scales,
        values=values,
        linear=linear,
        model=form.model(values, linear, scales),
        training_nrmse=nrmse,
        covariance=covariance,
        names=form.transform(scales)[0],
        correlation=correlation,
        at_bound=bound,
        start_nrmse=tuple(end[0] for end in ends),
        evaluations=problem.evaluations,
    )


def _uncertainty(
    problem: Projection, values: dict[str, float], linear: FloatArray, residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return covariance and correlation of the model's parameters.

    What a model leaves is no white noise, so the covariance is the sandwich over stretches of the recordings whose
    errors hang together; the correlation is that of the curvature alone.
    """
    columns, _ = problem.columns(values)
    slopes = []
    for name, value in values.items():
        step = 1e-4 * abs(value)
        moved, target = problem.columns({**values, name: value + step})
        slopes.append((residual - (target - linear @ moved)) / step)
    _, matrix = problem.form.transform(problem.scales)
    jacobian = np.linalg.inv(matrix).T @ np.vstack([*slopes, columns])
    size = np.linalg.norm(jacobian, axis=1)
    size[size == 0.0] = 1.0
    jacobian /= size[:, None]
    inverse = np.linalg.pinv(jacobian @ jacobian.T, rcond=1e-13, hermitian=True)
    _, block = np.unique(problem.data.block, return_inverse=True)
    scores = np.stack([np.bincount(block, weights=row * residual) for row in jacobian])
    blocks = scores.shape[1]
    meat = scores @ scores.T * (blocks / max(blocks - 1, 1))
    deviation = np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    covariance = inverse @ meat @ inverse / np.outer(size, size)
    return covariance, inverse / np.outer(deviation, deviation)
