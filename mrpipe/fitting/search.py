"""The Levenberg-Marquardt method on a projected residual, within bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.fitting.solution import Solved

OLDEST_JACOBIAN = 3
"""Numerical technique: number of steps after which the Jacobian is computed by finite differences again."""


@dataclass(frozen=True)
class Space:
    """The coordinates of a search.

    Attributes
    ----------
    solved
        Point, shape (p,) -> solution for the remaining coefficients.
    low, high
        Bounds, shape (p,).
    logarithmic
        Whether each coordinate is a logarithm, shape (p,).
    """

    solved: Callable[[FloatArray], Solved]
    low: FloatArray
    high: FloatArray
    logarithmic: BoolArray

    def jacobian(self, point: FloatArray, residual: FloatArray, among: Sequence[int] | None = None) -> FloatArray:
        """Return the derivative of the residual by finite differences, shape (p, m), or (k, m) for k coordinates.

        Parameters
        ----------
        point
            Coordinates, shape (p,).
        residual
            Residual there, shape (m,).
        among
            Indices of the coordinates; None: all.
        """
        places = range(len(point)) if among is None else among
        rows = np.zeros((len(places), len(residual)))
        for row, k in zip(rows, places, strict=True):
            low, high = self.low[k], self.high[k]
            width = 1e-3 * max(1.0, 0.02 * (high - low)) if self.logarithmic[k] else max(2e-5, 2e-3 * abs(point[k]))
            width = -width if point[k] + width > high else width
            # if the damper is unstable on both sides of a value, the value is kept
            for side in (width, -width):
                moved = point.copy()
                moved[k] += side
                slope = (self.solved(moved).residual - residual) / side
                if np.isfinite(slope @ slope):
                    row[:] = slope
                    break
        return rows


def search(space: Space, start: FloatArray, iterations: int, tolerance: float) -> tuple[FloatArray, Solved, int]:
    """Search the least sum of squared residuals from a starting point.

    Parameters
    ----------
    space
        Coordinates of the search.
    start
        Starting point, shape (p,).
    iterations
        Largest number of steps.
    tolerance
        The search ends when a step lowers the sum of squares by less than this share.

    Returns
    -------
    Point, shape (p,), solution there, and number of steps.
    """
    low, high = space.low, space.high
    point = np.clip(start, low, high)
    found = space.solved(point)
    cost = found.cost
    damping, done, jacobian, age = 1e-3, 0, np.zeros((len(point), len(found.residual))), OLDEST_JACOBIAN
    for done in range(1, iterations + 1):  # noqa: B007 - counted for the report
        if age >= OLDEST_JACOBIAN:
            jacobian, age = space.jacobian(point, found.residual), 0
        gram, gradient = jacobian @ jacobian.T, jacobian @ found.residual
        diagonal = np.maximum(np.diag(gram), 1e-12 * max(float(np.max(np.diag(gram), initial=0.0)), 1e-300))
        before, improved = cost, False
        for _ in range(5 if age == 0 else 2):
            free = ~(((point <= low) & (gradient > 0)) | ((point >= high) & (gradient < 0)))
            step = np.zeros(len(point))
            if free.any():
                matrix = gram[np.ix_(free, free)] + damping * np.diag(diagonal[free])
                step[free] = -np.linalg.lstsq(matrix, gradient[free], rcond=None)[0]
            trial = np.clip(point + np.clip(step, -1.0, 1.0), low, high)
            tried = space.solved(trial)
            if tried.cost < cost:
                moved = trial - point
                missed = tried.residual - found.residual - moved @ jacobian
                # a simulation for every parameter is expensive: Broyden's update is used between two Jacobians by
                # differences
                jacobian += np.outer(moved / max(float(moved @ moved), 1e-300), missed)
                point, cost, improved, found = trial, tried.cost, True, tried
                damping = max(damping * 0.2, 1e-9)
                break
            damping *= 8.0
        if improved and before - cost >= tolerance * before:
            age += 1
        elif age == 0:
            break
        else:
            age = OLDEST_JACOBIAN
    return point, found, done
