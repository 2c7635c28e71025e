"""Mode shapes at all floors, orthogonal with respect to the mass, from those at floors with a sensor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq, lsq_linear, minimize

from mrpipe.artifacts import FloatArray

_LEAST_ERROR = 1e-6
"""Least error of a shape element over the norm of the shape; a smaller one only worsens the conditioning."""
_TURNS = 50
_SECOND_STEP = 1e-3
"""Step of the second differences by an angle [rad]."""
_OTHER = 0.3
"""Rows of unit norm that differ by more than this are another solution."""
_AMBIGUOUS = 4.0
"""Two reflections are both possible if their squared misfits over the variance differ by less than this."""


@dataclass(frozen=True)
class Completion:
    """Shapes at all floors.

    Attributes
    ----------
    shapes
        Shape (n, n), normalised to the mass.
    turn_error
        Standard error [rad] of the rotation of the rows of floors without a sensor; zero with at most one such floor,
        infinite if another sign of a row is equally likely.
    """

    shapes: FloatArray
    turn_error: float


def completed_shapes(
    shapes: FloatArray,
    errors: FloatArray,
    measured: Sequence[int],
    masses: FloatArray,
    angular_frequencies: FloatArray,
) -> Completion:
    """Return the shapes orthogonal to the mass that fit the rows of floors with a sensor, weighted by certainty.

    With L = M^(1/2) the mass-normalised shapes form an orthogonal matrix. Its measured rows A are known up to a scale
    d_r of each mode, and A diag(d^2) A' = 1 gives these scales. The other rows span the complement of the measured
    ones. The measurements do not determine the rotation of the complement. The rotation with the smallest stiffness
    between floors that are not neighbours is taken. The remaining elements of K between such floors are taken as errors
    of this assumption, and give the standard error of the rotation.

    Parameters
    ----------
    shapes
        Shape (n, n); the rows of floors without a sensor are a first guess.
    errors
        Shape (n, n): standard errors of the measured rows.
    measured
        Floors (from 0) with a sensor.
    masses
        Shape (n,) [kg].
    angular_frequencies
        Shape (n,) [rad/s].
    """
    root = np.sqrt(masses)[:, None]
    rows = list(measured)
    unknown = [row for row in range(shapes.shape[0]) if row not in measured]
    size = np.linalg.norm(root * shapes, axis=0)
    scaled = root * shapes / size
    if not unknown:
        whole = _nearest_orthonormal(scaled)
    else:
        whole = np.empty_like(scaled)
        whole[rows] = _nearest_orthonormal(scaled[rows] * _mode_scales(scaled[rows]))
        rest = scaled[unknown] - scaled[unknown] @ whole[rows].T @ whole[rows]
        whole[unknown] = _nearest_orthonormal(rest)
    whole = _by_certainty(whole, scaled[rows], root[rows] * errors[rows] / size, rows)
    turn_error = 0.0
    if unknown:
        whole[unknown], turn_error = _rotated(whole, unknown, whole[unknown], angular_frequencies, masses)
    return Completion(np.asarray(whole / root), turn_error)


def _by_certainty(start: FloatArray, seen: FloatArray, errors: FloatArray, rows: Sequence[int]) -> FloatArray:
    """Return the orthogonal matrix whose rows fit the measured ones best, each element weighted by its variance.

    Without weights a mode with an uncertain shape would rotate the shapes of the others. Errors that all modes share
    (cross-talk, gains, masses) are a second variance. It is chosen such that the squared misfit equals its degrees of
    freedom (the random-effects estimate of Paule and Mandel 1982).

    Parameters
    ----------
    start
        Orthogonal, shape (n, n).
    seen, errors
        Measured rows of unit columns and their standard errors, shape (p, n).
    rows
        Places of the measured rows.
    """
    floors, count = start.shape[0], len(rows)
    free = floors - count
    angles = (floors * (floors - 1) - free * (free - 1)) // 2
    freedom = count * floors - floors - angles
    if freedom < 1:
        return start
    share = np.linalg.norm(seen, axis=0) / np.sqrt(count)

    def fitted(common: float) -> tuple[FloatArray, float]:
        weight = 1.0 / np.sqrt(np.maximum(errors, _LEAST_ERROR) ** 2 + (common * share) ** 2)
        return _turned(start, seen, weight, rows)

    whole, squared = fitted(0.0)
    if squared <= freedom:
        return whole
    level = brentq(lambda log: np.log(fitted(float(np.exp(log)))[1] / freedom), np.log(1e-5), np.log(10.0), xtol=0.1)
    return fitted(float(np.exp(level)))[0]


def _turned(start: FloatArray, seen: FloatArray, weight: FloatArray, rows: Sequence[int]) -> tuple[FloatArray, float]:
    """Rotate an orthogonal matrix until its rows fit `seen` best; return it and the squared misfit (Gauss-Newton).

    The scale of each mode is free, so that the misfit is the part of the weighted column across the measured one.
    """
    along = weight * seen
    along = along / np.linalg.norm(along, axis=0)

    def misfit(part: FloatArray, mode: int | slice) -> FloatArray:
        left = weight[:, mode] * part
        return np.asarray(left - along[:, mode] * np.sum(along[:, mode] * left, axis=0))

    first, second = np.triu_indices(start.shape[0], 1)
    whole, cost = start, float(np.sum(misfit(start[rows], slice(None)) ** 2))
    damping = 1e-3
    for _ in range(_TURNS):
        own = whole[rows]
        change = np.zeros((first.size, *own.shape))
        for place, (i, j) in enumerate(zip(first.tolist(), second.tolist(), strict=True)):
            # a small rotation in the plane of two modes
            change[place, :, j] = misfit(own[:, i], j)
            change[place, :, i] = -misfit(own[:, j], i)
        slope = change.reshape(first.size, -1)
        gram, pull = slope @ slope.T, slope @ misfit(own, slice(None)).ravel()
        turn = np.zeros(start.shape)
        turn[first, second] = -np.linalg.solve(gram + damping * np.diag(np.diag(gram) + 1e-12), pull)
        trial = whole @ expm(turn - turn.T)
        trial_cost = float(np.sum(misfit(trial[rows], slice(None)) ** 2))
        if trial_cost > cost:
            damping *= 10.0
            continue
        settled = cost - trial_cost <= 1e-6 * cost
        whole, cost, damping = trial, trial_cost, 0.1 * damping
        if settled:
            break
    return whole, cost


def _mode_scales(rows: FloatArray) -> FloatArray:
    """Return d (n,) of A diag(d^2) A' = 1 by least squares, or ones if there is no positive solution."""
    size = rows.shape[0]
    upper = [(i, j) for i in range(size) for j in range(i, size)]
    if len(upper) < rows.shape[1]:
        return np.ones(rows.shape[1])
    matrix = np.array([rows[i] * rows[j] for i, j in upper])
    squared = lsq_linear(matrix, [float(i == j) for i, j in upper], bounds=(1e-6, np.inf)).x
    return np.asarray(np.sqrt(squared))


def _rotated(
    whole: FloatArray, unknown: list[int], start: FloatArray, angular_frequencies: FloatArray, masses: FloatArray
) -> tuple[FloatArray, float]:
    """Return the rows of floors without a sensor, rotated and reflected for the least stiffness beyond neighbours.

    The second result is the standard error of the rotation [rad].
    """
    count, floors = len(unknown), whole.shape[0]
    beyond = np.abs(np.subtract.outer(np.arange(floors), np.arange(floors))) > 1
    root = np.sqrt(masses)
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]

    def rows_of(angles: FloatArray, signs: FloatArray) -> FloatArray:
        turn = np.zeros((count, count))
        for (i, j), angle in zip(pairs, angles, strict=True):
            turn[i, j], turn[j, i] = angle, -angle
        return np.asarray(signs[:, None] * (expm(turn) @ start))

    def cost(angles: FloatArray, signs: FloatArray) -> float:
        trial = whole.copy()
        trial[unknown] = rows_of(angles, signs)
        stiffness = root[:, None] * (trial * angular_frequencies**2) @ trial.T * root
        scale = np.sqrt(np.diag(stiffness))
        relative = stiffness / np.outer(scale, scale)
        # a positive element between neighbours would be a negative storey stiffness
        wrong = np.maximum(np.diag(relative, 1), 0.0)
        return float(np.sum(relative[beyond] ** 2) + 2.0 * np.sum(wrong**2))

    found = []
    for choice in range(2**count):
        signs = np.array([1.0 if choice >> bit & 1 else -1.0 for bit in range(count)])
        for angle in np.linspace(0.0, np.pi, 7)[:-1] if pairs else (0.0,):
            first = np.full(len(pairs), angle)
            angles = minimize(cost, first, args=(signs,)).x if pairs else first
            found.append((cost(angles, signs), angles, signs))
    least, angles, signs = min(found, key=lambda item: item[0])
    best = rows_of(angles, signs)
    # both triangles of K are counted in the cost
    variance = least / max(0.5 * np.count_nonzero(beyond) - len(pairs), 1.0)
    others = [value for value, *place in found if np.abs(rows_of(*place) - best).max() > _OTHER]
    if others and min(others) - least < _AMBIGUOUS * variance:
        return best, np.inf
    return best, _turn_error(lambda moved: cost(moved, signs), angles, variance)


def _turn_error(cost: Callable[[FloatArray], float], angles: FloatArray, variance: float) -> float:
    """Return the largest standard error of the angles at the minimum of a sum of squares with a given variance."""
    if not angles.size:
        return 0.0
    steps = _SECOND_STEP * np.eye(angles.size)
    corners = np.array([
        [cost(angles + i + j) - cost(angles + i - j) - cost(angles - i + j) + cost(angles - i - j) for j in steps]
        for i in steps
    ])  # fmt: skip
    curvature, directions = np.linalg.eigh(corners / (4.0 * _SECOND_STEP**2))
    spread = 2.0 * variance * np.sum(directions**2 / np.maximum(curvature, 1e-12), axis=1)
    return float(np.sqrt(spread.max()))


def _nearest_orthonormal(rows: FloatArray) -> FloatArray:
    left, _, right = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(left @ right)
