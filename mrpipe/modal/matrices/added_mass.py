"""Scale of mode shapes from tests with known added masses.

With the masses dM added, mode k moves from frequency w_k to w'_k and has the shape y_k. The modified mode is a
combination of the modes x_r without added masses (any scale; a_r x_r x_r' is the mass-normalised product):

    y_k = sum_r a_r x_r w'_k^2 (x_r' dM y_k) / (w_r^2 - w'_k^2)

This is linear in the unknown scales a_r [1/kg], holds at every sensor, and is exact where all modes are known. Only the
floors with an added mass need a sensor.

Source: Brandt et al. (2019), Scaling of mode shapes from operational modal analysis using harmonic forces and mass
changes; the first-order form is that of Parloo et al. (2002), Sensitivity-based operational mode shape normalisation,
Mechanical Systems and Signal Processing 16.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.search.selection import shape_errors

_LEAST_ASSURANCE = 0.5
_LARGEST_ERROR = 0.35
"""Relative error from which on a scale counts as unknown, because the mass hardly shifts this mode."""


@dataclass(frozen=True)
class ModalScale:
    """Scale of each mode of a fit.

    Attributes
    ----------
    values
        Shape (r,) [1/kg]: squared factor that makes a shape of unit norm over the sensors mass-normalised; nan where
        unknown.
    errors
        Shape (r,): relative standard errors.
    """

    values: FloatArray
    errors: FloatArray


@dataclass(frozen=True)
class _Equations:
    """Rows of the linear system for the scales, and the relative error of the scale from each modified mode."""

    matrix: FloatArray
    target: FloatArray
    errors: FloatArray


def _squares_error(fit: MultiModeFit) -> FloatArray:
    """Return the standard errors of the squared angular frequencies, shape (r,)."""
    modes = fit.angular_frequencies.size
    return np.asarray(2.0 * fit.angular_frequencies**2 * np.sqrt(np.diag(fit.covariance)[:modes]))


def _equations(base: MultiModeFit, changed: MultiModeFit, added: dict[int, float]) -> _Equations:
    common = [sensor for sensor in base.sensors if sensor in changed.sensors]
    first = [base.sensors.index(sensor) for sensor in common]
    second = [changed.sensors.index(sensor) for sensor in common]
    shapes = base.residues.real / np.linalg.norm(base.residues.real, axis=0)
    moved = changed.residues.real / np.linalg.norm(changed.residues.real, axis=0)
    mass = np.array([added.get(sensor.floor, 0.0) for sensor in common])
    omega, own_error, other_error = base.angular_frequencies**2, _squares_error(base), _squares_error(changed)
    rows, target = [], []
    errors = np.full(omega.size, np.inf)
    for k, square in enumerate(changed.angular_frequencies**2):
        x, y = shapes[first], moved[second, k]
        likeness = (x.T @ y) ** 2 / np.maximum(np.sum(x**2, axis=0) * float(y @ y), 1e-300)
        near = int(np.argmax(likeness - np.abs(np.log(omega / square))))
        shift = omega - square
        error = float(np.hypot(own_error[near], other_error[k])) / max(abs(float(shift[near])), 1e-300)
        error = float(np.hypot(error, np.hypot(shape_errors(base)[near], shape_errors(changed)[k])))
        if likeness[near] < _LEAST_ASSURANCE or shift[near] <= 0.0:
            continue
        errors[near] = min(errors[near], error)
        # the equation of a mode with a small shift is uncertain; its weight follows from the error of the shift
        weight = 1.0 / max(error, 1e-4)
        rows.append(weight * x * (square * (mass * y) @ x / shift))
        target.append(weight * y)
    if not rows:
        return _Equations(np.zeros((0, omega.size)), np.zeros(0), errors)
    return _Equations(np.vstack(rows), np.concatenate(target), errors)


def modal_scale(base: MultiModeFit, changed: Sequence[tuple[MultiModeFit, dict[int, float]]]) -> ModalScale:
    """Return the scale of each mode from fits of the structure with added masses.

    Parameters
    ----------
    base
        Modes without added masses.
    changed
        For each state of the structure: its modes, and the added mass [kg] of each floor (from 1) that has one.
    """
    parts = [_equations(base, fit, added) for fit, added in changed]
    matrix, target = np.vstack([part.matrix for part in parts]), np.concatenate([part.target for part in parts])
    errors = 1.0 / np.sqrt(np.maximum(sum(1.0 / part.errors**2 for part in parts), 1e-300))
    known = np.flatnonzero(errors < _LARGEST_ERROR)
    values = np.full(errors.size, np.nan)
    if known.size:
        columns = matrix[:, known]
        size = np.linalg.norm(columns, axis=0)
        values[known] = lsq_linear(columns / size, target, bounds=(0.0, np.inf)).x / size
    values[values <= 0.0] = np.nan
    return ModalScale(values, np.where(np.isfinite(values), errors, np.inf))
