"""Fit of a base form with effects: simulate, solve for the linear coefficients, search the nonlinear ones.

The residual depends on the searched parameters only, after the linear coefficients are solved for at each trial
(variable projection; Golub and Pereyra 1973, SIAM J. Numer. Anal. 10, 413-432).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.laws import Law
from mrpipe.dampers.plant import Chain, Step, build_chain
from mrpipe.fitting.coupled import coupled
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.search import Space, search
from mrpipe.fitting.solution import Solved, regressors, solve
from mrpipe.fitting.weighting import Weighting, centred, weighting

AGAIN = 0.99
"""Numerical technique: the search of a coupled form is repeated while it lowers the error to below this share."""


@dataclass(frozen=True)
class Fit:
    """A fitted problem.

    Attributes
    ----------
    problem
        Problem that was fitted.
    theta
        Searched parameters in the coordinates of the search, see :meth:`Problem.encode`, shape (p,).
    linear
        Linear coefficients, shape (c,): of the laws of the drive (in the basis of their shapes), then amplitudes.
    test_offsets
        Offset of each test [N].
    cost
        Sum of squared weighted residuals.
    residual
        Weighted residual, shape (n,); 0 at samples that are not compared.
    at_bound
        Names of searched parameters and amplitudes of terms at a bound.
    iterations
        Iterations of the search.
    """

    problem: Problem
    theta: FloatArray
    linear: FloatArray
    test_offsets: FloatArray
    cost: float
    residual: FloatArray
    at_bound: tuple[str, ...] = ()
    iterations: int = 0

    @property
    def chi_square(self) -> float:
        """Return the mean squared weighted residual."""
        return self.cost / max(int(np.count_nonzero(self.problem.root_weight)), 1)

    @property
    def laws(self) -> tuple[Law, ...]:
        """Return the laws of the drive: yield force, viscosity and, if present, the force of the second part."""
        return self.problem.base.laws_of(self.linear, self.base_values, self.problem.scales.drive)

    @property
    def term_values(self) -> list[dict[str, float]]:
        """Return the parameter values of each term, amplitudes included."""
        return self._all_values()[1:]

    @property
    def base_values(self) -> dict[str, float]:
        """Return the parameter values of the base form, amplitudes included."""
        return self._all_values()[0]

    def _all_values(self) -> list[dict[str, float]]:
        values = self.problem.values(self.theta)
        first = self.problem.base.columns
        for (index, parameter), value in zip(self.problem.amplitudes, self.linear[first:], strict=True):
            values[index + 1][parameter.name] = float(value)
        return values

    def chain(self) -> Chain:
        """Return the chain of steps with the fitted numbers."""
        return build_chain(self.steps())

    def steps(self) -> list[Step]:
        """Return all steps of the fitted damper."""
        problem = self.problem
        steps = problem.base.steps(self.base_values, *self.laws)
        for term, values in zip(problem.terms, self.term_values, strict=True):
            steps.extend(term.form.steps(values))
        return steps


def fit(problem: Problem, start: FloatArray, *, iterations: int = 15, tolerance: float = 2e-4) -> Fit:
    """Fit from a starting point by the Levenberg-Marquardt method on the projected residual.

    The steps of a coupled form read the laws of the drive, which are then searched as well, see
    :mod:`mrpipe.fitting.coupled`.
    """
    w = weighting(problem)
    if problem.base.form.coupled:
        return _coupled_fit(problem, start, w, iterations, tolerance)
    theta, found, done = search(_space(problem, w), start, iterations, tolerance)
    return _result(problem, theta, w, found, done)


def _coupled_fit(problem: Problem, start: FloatArray, w: Weighting, iterations: int, tolerance: float) -> Fit:
    """Fit a coupled form: search with given laws, then search the laws as well, and repeat both within `iterations`."""
    theta = np.clip(start, *problem.bounds())
    best, left = _with_searched_laws(problem, theta, w, 0, tolerance), iterations
    while left > 0:
        # the laws that are solved for lead out of narrow valleys in which a search of all numbers takes many steps
        moved = search(_space(problem, w), theta, max(3, iterations // 3), tolerance)[0]
        found = _with_searched_laws(problem, moved, w, left, tolerance)
        left -= found.iterations
        before, best = best, min(best, found, key=lambda item: item.cost)
        if best.cost > AGAIN * before.cost:
            break
        problem, theta = best.problem, best.theta
    return replace(best, iterations=iterations - left)


def _with_searched_laws(problem: Problem, theta: FloatArray, w: Weighting, iterations: int, tolerance: float) -> Fit:
    whole, begun = coupled(problem, theta, w)
    point, found, done = search(whole.space, begun, iterations, tolerance)
    return _result(replace(problem, reference=whole.laws(point)), whole.divided(point)[0], w, found, done)


def _space(problem: Problem, w: Weighting) -> Space:
    low, high = problem.bounds()
    logarithmic = np.array([parameter.logarithmic for _, parameter in problem.searched], dtype=bool)
    return Space(lambda theta: solve(problem, theta, w), low, high, logarithmic)


def searched_derivatives(found: Fit) -> FloatArray:
    """Return how the weighted residual changes with the searched parameters, shape (p, m).

    The linear coefficients are solved for at each value. In a coupled form only the amplitudes are.
    """
    problem = found.problem
    w = weighting(problem)
    if not problem.base.form.coupled:
        return _space(problem, w).jacobian(found.theta, found.residual[w.at])
    whole, point = coupled(problem, found.theta, w)
    return whole.space.jacobian(point, whole.solved(point).residual, range(len(found.theta)))


def linear_derivatives(found: Fit, columns: FloatArray) -> FloatArray:
    """Return how the weighted residual changes with the linear coefficients, shape (c, m).

    Parameters
    ----------
    found
        The fit.
    columns
        Regressors of the fit, shape (c, n). The steps of a coupled form read the laws, so that these regressors are
        only a part of the derivative.
    """
    problem = found.problem
    w = weighting(problem)
    rows = -centred(columns, w)[0]
    if problem.base.form.coupled:
        whole, point = coupled(problem, found.theta, w)
        laws = len(whole.sizes)
        changes = whole.space.jacobian(point, whole.solved(point).residual, range(len(found.theta), len(point)))
        rows[:laws] = changes / whole.sizes[:, None]
    return rows


def _result(problem: Problem, theta: FloatArray, w: Weighting, found: Solved, iterations: int) -> Fit:
    low, high = problem.bounds()
    margin = 1e-3 * (high - low)
    names = [
        parameter.name
        for (index, parameter), t, a, b, m in zip(problem.searched, theta, low, high, margin, strict=True)
        if index >= 0 and (t <= a + m or t >= b - m)
    ]
    first = problem.base.columns
    names += [
        p.name for (k, p), stuck in zip(problem.amplitudes, found.at_bound[first:], strict=True) if stuck and k >= 0
    ]
    full = np.zeros(len(problem.recordings.force))
    full[w.at] = found.residual
    offsets = np.zeros(problem.recordings.tests)
    if problem.offsets:
        offsets[np.unique(w.test)] = found.means
    else:
        offsets[:] = found.means[0]
    return Fit(problem, theta, found.linear, offsets, found.cost, full, tuple(names), iterations)


def predict(found: Fit, recordings: Recordings) -> FloatArray:
    """Return the force [N] of a fitted damper on other tests, shape (n,), in a free run and without test offsets."""
    problem = replace(found.problem, recordings=recordings, root_weight=np.zeros(len(recordings.force)))
    return np.asarray(found.linear @ regressors(problem, found.theta))


def start_of(problem: Problem, base: Mapping[str, float], terms: Sequence[Mapping[str, float]]) -> FloatArray:
    """Return a starting point from values of the base and of each term; parameters left out take their first start."""
    given = [base, *terms]
    values = []
    for index, parameter in problem.searched:
        default = parameter.start_values(problem.scales)[0]
        values.append(float(given[index + 1].get(parameter.name, default)))
    low, high = problem.bounds()
    return np.clip(problem.encode(values), low, high)
