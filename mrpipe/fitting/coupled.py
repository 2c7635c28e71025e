"""Fits of base forms whose steps read the laws of the drive.

In these forms, such as a valve in series with a spring, the motion of an inner element depends on the yield force and
on the viscosity. The laws of the drive are then nonlinear coefficients, and they are searched together with the
parameters of the form. Only the amplitudes of effects remain linear.

To solve for the laws while the steps read those of the solution before, and to repeat this, does not converge if the
inner element carries much of the motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.laws import Law
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.search import Space
from mrpipe.fitting.solution import Solved, bounded_solution, regressors, solve_rows, unstable
from mrpipe.fitting.weighting import Weighting, centred

LEVELS = 21
"""Numerical technique: levels of the drive at which the coefficients of a law are found from its values."""

LEAST_SIZE = 1e-6
"""Numerical technique: least response of a coefficient, as a share of the measured force."""


@dataclass(frozen=True)
class Coupled:
    """A problem in which the coefficients of the laws are searched.

    Attributes
    ----------
    problem
        The problem.
    w
        Samples and weights.
    sizes
        Unit of each coefficient: the one with which its column is as large as the measured force, shape (c,).
    """

    problem: Problem
    w: Weighting
    sizes: FloatArray

    def laws(self, point: FloatArray) -> tuple[Law, ...]:
        """Return the laws of the drive at a point of the search."""
        theta, coefficients = self.divided(point)
        return self.problem.base.laws_of(coefficients, self.problem.values(theta)[0], self.problem.scales.drive)

    def divided(self, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the searched parameters, and the coefficients of the laws and of a known force."""
        count = len(self.problem.searched)
        known = np.ones(int(self.problem.base.form.known))
        return point[:count], np.concatenate([point[count:] * self.sizes, known])

    def solved(self, point: FloatArray) -> Solved:
        """Return the solution for the amplitudes, with laws that are both read and summed."""
        theta, coefficients = self.divided(point)
        problem, first, w = replace(self.problem, reference=self.laws(point)), self.problem.base.columns, self.w
        rows, means = centred(regressors(problem, theta), w)
        if not np.all(np.isfinite(means)):
            return unstable(len(rows), w)
        target = w.target - coefficients @ rows[:first]
        low, high = (bound[first:] for bound in problem.linear_bounds)
        own = rows[first:]
        amplitudes, at_bound = bounded_solution(own @ own.T, own @ target, low, high)
        linear = np.concatenate([coefficients, amplitudes])
        stuck = np.concatenate([np.zeros(first, dtype=bool), at_bound])
        return Solved(target - amplitudes @ own, linear, w.target_means - linear @ means, stuck)

    @property
    def space(self) -> Space:
        """Coordinates of the search: those of the parameters, then the coefficients of the laws in their units."""
        low, high = self.problem.bounds()
        laws = len(self.sizes)
        logarithmic = [parameter.logarithmic for _, parameter in self.problem.searched]
        return Space(
            self.solved,
            np.concatenate([low, np.zeros(laws)]),
            np.concatenate([high, np.full(laws, np.inf)]),
            np.array([*logarithmic, *[False] * laws], dtype=bool),
        )


def coupled(problem: Problem, theta: FloatArray, w: Weighting) -> tuple[Coupled, FloatArray]:
    """Return the problem with searched laws, and the better one of two points.

    The laws of one point are the reference of the problem, those of the other one are solved for.

    Parameters
    ----------
    problem
        The problem.
    theta
        Searched parameters, shape (p,).
    w
        Samples and weights.
    """
    count = problem.base.columns - int(problem.base.form.known)
    rows, means = centred(regressors(problem, theta), w)
    force = float(np.linalg.norm(w.target))
    response = np.linalg.norm(rows[:count], axis=1) if np.all(np.isfinite(means[:count])) else np.zeros(count)
    whole = Coupled(problem, w, force / np.maximum(response, LEAST_SIZE * force))
    choices = [_coefficients_of(problem, theta), solve_rows(problem, rows, means, w).linear[:count]]
    points = [np.concatenate([theta, item / whole.sizes]) for item in choices]
    return whole, min(points, key=lambda point: whole.solved(point).cost)


def _coefficients_of(problem: Problem, theta: FloatArray) -> FloatArray:
    """Return the coefficients with which the laws of a problem are its reference, as closely as possible."""
    share = np.linspace(0.0, 1.0, LEVELS)
    drive = problem.scales.drive
    scales = problem.base.scale_shares(problem.values(theta)[0], drive)
    found = []
    for law, scale, given in zip(problem.base.laws, scales, problem.reference, strict=True):
        basis = law.basis(share, scale)
        bounds = np.zeros(len(basis)), np.full(len(basis), np.inf)
        found.append(bounded_solution(basis @ basis.T, basis @ given(share * drive), *bounds)[0])
    return np.concatenate(found)
