"""Floor masses from mode shapes: modes are orthogonal to the mass, and a scale of the modes gives its size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from mrpipe.artifacts import FloatArray

NORMAL_95 = 1.959964
_LEAST_SHAPE_ERROR = 0.003
"""Relative error of a shape beyond noise: cross-talk and gains of the sensors."""
_UNDETERMINED = 0.5


@dataclass(frozen=True)
class FloorMasses:
    """Masses of all floors.

    Attributes
    ----------
    masses, intervals
        Values and 95 % intervals, shape (n,) and (n, 2) [kg].
    freedom
        Number of equations minus number of unknown masses.
    misfit
        Sum of squares of the weighted equations over `freedom`; the intervals contain it where it is above one.
    """

    masses: FloatArray
    intervals: FloatArray
    freedom: int = 0
    misfit: float = 1.0


def masses_by_orthogonality(
    shapes: FloatArray, relative_errors: FloatArray, masses: FloatArray, scales: FloatArray, scale_errors: FloatArray
) -> FloorMasses | None:
    """Return the masses for which the shapes are orthogonal; None if the data do not determine all of them.

    For two modes sum_i m_i x_ir x_is = 0, and for a mode of known scale sum_i m_i x_ir^2 = 1 / a_r. No model of the
    stiffness is needed.

    Parameters
    ----------
    shapes
        Shape (n, r), measured at all floors.
    relative_errors
        Shape (r,): error of each shape over its norm.
    masses
        Shape (n,) [kg]; nan where unknown.
    scales, scale_errors
        Shape (r,) [1/kg] for shapes of unit norm, nan where unknown, and their relative errors.
    """
    unit = shapes / np.linalg.norm(shapes, axis=0)
    unknown = np.flatnonzero(~np.isfinite(masses))
    given = np.where(np.isfinite(masses), masses, 0.0)
    scaled = np.flatnonzero(np.isfinite(scales) & (scales > 0.0))
    if not scaled.size and unknown.size == masses.size:
        return None
    typical = float(np.median(1.0 / scales[scaled])) if scaled.size else float(np.nanmean(masses))
    error = np.hypot(relative_errors, _LEAST_SHAPE_ERROR)
    rows, target = [], []
    for r in range(unit.shape[1]):
        for s in range(r):
            product = unit[:, r] * unit[:, s]
            weight = 1.0 / (typical * float(np.hypot(error[r], error[s])))
            rows.append(weight * product[unknown])
            target.append(-weight * float(product @ given))
    for r in scaled.tolist():
        weight = float(scales[r]) / max(float(scale_errors[r]), _LEAST_SHAPE_ERROR)
        rows.append(weight * unit[unknown, r] ** 2)
        target.append(weight * (1.0 / float(scales[r]) - float(unit[:, r] ** 2 @ given)))
    matrix, values = np.array(rows), np.array(target)
    if matrix.shape[0] < unknown.size or np.linalg.matrix_rank(matrix * typical, tol=1e-6) < unknown.size:
        return None
    found = lsq_linear(matrix, values, bounds=(1e-6 * typical, np.inf)).x
    rest = matrix @ found - values
    freedom = values.size - unknown.size
    misfit = float(rest @ rest) / max(freedom, 1)
    variance = max(1.0, misfit)
    spread = NORMAL_95 * np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)) * variance)
    if np.any(spread > _UNDETERMINED * found):
        return None
    whole = given.copy()
    whole[unknown] = found
    intervals = np.column_stack([whole, whole])
    intervals[unknown] += np.outer(spread, [-1.0, 1.0])
    return FloorMasses(whole, intervals, freedom, misfit)
