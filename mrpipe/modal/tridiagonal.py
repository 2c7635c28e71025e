"""Shear-frame stiffness (tri-diagonal) that fits measured modes, with bounds on the storeys."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import least_squares, lsq_linear

from mrpipe.artifacts import FloatArray
from mrpipe.structures import shear_stiffness

_NORMAL_95 = 1.959964


@dataclass(frozen=True)
class TridiagonalFit:
    """Storeys of the shear frame nearest to measured modes.

    Attributes
    ----------
    storey_stiffnesses, low, high
        Value and 95 % interval, shape (n,) [N/m], lowest storey first.
    stiffness
        Shape (n, n) [N/m].
    frequency_error
        Model over measured, minus one, shape (r,) [1].
    at_bound
        Storeys (from 1) that ended at a bound: the shear frame does not suit them.
    """

    storey_stiffnesses: FloatArray
    low: FloatArray
    high: FloatArray
    stiffness: FloatArray
    frequency_error: FloatArray
    at_bound: tuple[int, ...]


def _drift_matrix(shape: FloatArray) -> FloatArray:
    """Return D with K(k) u = D k for a shear frame, shape (n, n)."""
    drift = np.diff(shape, prepend=0.0)
    return np.diag(drift) - np.diag(drift[1:], 1)


def first_storeys(
    mass: FloatArray, mode_shapes: FloatArray, angular_frequencies: FloatArray, bounds: tuple[float, float]
) -> FloatArray:
    """Return storeys [N/m] by bounded linear least squares on K(k) u = omega2 M u, each mode with equal weight."""
    rows, target = [], []
    for shape, omega in zip(mode_shapes.T, angular_frequencies, strict=True):
        inertia = omega**2 * (mass @ shape)
        scale = np.linalg.norm(inertia)
        rows.append(_drift_matrix(shape) / scale)
        target.append(inertia / scale)
    return np.asarray(lsq_linear(np.vstack(rows), np.concatenate(target), bounds=bounds).x)


def fit_tridiagonal(
    mass: FloatArray,
    mode_shapes: FloatArray,
    angular_frequencies: FloatArray,
    *,
    frequency_error: float = 1e-3,
    shape_error: float = 2e-2,
    bounds: tuple[float, float] = (1.0, 1e12),
) -> TridiagonalFit:
    """Fit storey stiffnesses to frequencies and shapes of all modes.

    Parameters
    ----------
    mass
        Shape (n, n), diagonal [kg].
    mode_shapes, angular_frequencies
        Shape (n, r), (r,) [rad/s].
    frequency_error, shape_error
        Standard errors taken for the weights: relative, and of a shape with unit modal mass over its norm.
    bounds
        Of each storey [N/m].
    """
    root = np.sqrt(np.diag(mass))[:, None]
    measured = root * mode_shapes
    measured = measured / np.linalg.norm(measured, axis=0)
    modes = angular_frequencies.size

    def residual(theta: FloatArray) -> FloatArray:
        squared, shapes = eigh(shear_stiffness(np.exp(theta)), mass)
        model = (root * shapes)[:, :modes]
        turned = model * np.sign(np.sum(model * measured, axis=0))
        frequency = 0.5 * np.log(np.maximum(squared[:modes], 1e-30)) - np.log(angular_frequencies)
        return np.concatenate([frequency / frequency_error, ((turned - measured) / shape_error).ravel()])

    low, high = (np.log(value) for value in bounds)
    start = np.log(np.clip(first_storeys(mass, mode_shapes, angular_frequencies, bounds), *bounds))
    margin = 1e-9 * (high - low)
    result = least_squares(residual, np.clip(start, low + margin, high - margin), bounds=(low, high))
    storeys = np.exp(result.x)
    covariance = np.linalg.pinv(result.jac.T @ result.jac)
    freedom = max(1, result.fun.size - storeys.size)
    spread = _NORMAL_95 * np.sqrt(np.diag(covariance) * 2.0 * result.cost / freedom)
    stiffness = shear_stiffness(storeys)
    omega = np.sqrt(np.maximum(eigh(stiffness, mass, eigvals_only=True)[:modes], 0.0))
    stuck = np.flatnonzero((result.x - low < 1e-6) | (high - result.x < 1e-6)) + 1
    return TridiagonalFit(
        storey_stiffnesses=storeys,
        low=storeys * np.exp(-spread),
        high=storeys * np.exp(spread),
        stiffness=stiffness,
        frequency_error=omega / angular_frequencies - 1.0,
        at_bound=tuple(int(item) for item in stuck),
    )
