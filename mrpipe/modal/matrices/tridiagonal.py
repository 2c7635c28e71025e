"""Shear-frame stiffness (tri-diagonal) that fits measured modes, with bounds on the storeys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import lsq_linear

from mrpipe.artifacts import FloatArray
from mrpipe.modal.matrices.updating import MeasuredModes, UpdatedModel, storey_model, update_model, with_jackknife
from mrpipe.structures import shear_stiffness

_MOST_ASSIGNMENTS = 80
FREQUENCY_ERROR = 1e-3
SHAPE_ERROR = 2e-2
BOUNDS = (1.0, 1e12)


@dataclass(frozen=True)
class TridiagonalFit:
    """Storey stiffnesses of the shear frame nearest to measured modes.

    Attributes
    ----------
    storey_stiffnesses, low, high
        Value and 95 % interval, shape (n,) [N/m], lowest storey first.
    stiffness
        Shape (n, n) [N/m].
    frequency_error
        Model over measured, minus one, shape (r,) [1].
    at_bound
        Storeys (from 1) that ended at a bound, because a shear frame does not represent them.
    undetermined
        Storeys (from 1) whose interval is wider than half of their value.
    """

    storey_stiffnesses: FloatArray
    low: FloatArray
    high: FloatArray
    stiffness: FloatArray
    frequency_error: FloatArray
    at_bound: tuple[int, ...]
    undetermined: tuple[int, ...] = ()


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
    frequency_error: float = FREQUENCY_ERROR,
    shape_error: float = SHAPE_ERROR,
    bounds: tuple[float, float] = BOUNDS,
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
        Bounds of the stiffness of each storey [N/m].
    """
    modes = _all_modes(mode_shapes, angular_frequencies, frequency_error, shape_error)
    return storeys_of(_updated(mass, modes, bounds), bounds)


def _all_modes(shapes: FloatArray, omega: FloatArray, frequency_error: float, shape_error: float) -> MeasuredModes:
    rows, numbers = tuple(range(shapes.shape[0])), tuple(range(1, omega.size + 1))
    return MeasuredModes(omega, shapes, rows, numbers, frequency_error=frequency_error, shape_error=shape_error)


def _updated(mass: FloatArray, modes: MeasuredModes, bounds: tuple[float, float]) -> UpdatedModel:
    masses = np.diag(mass)
    start = np.clip(first_storeys(mass, modes.shapes, modes.angular_frequencies, bounds), *bounds)
    return update_model(storey_model(masses.size), masses, modes, start, bounds=bounds)


def storey_misfit(masses: FloatArray, mode_shapes: FloatArray, angular_frequencies: FloatArray) -> float:
    """Return the sum of squares that :func:`fit_tridiagonal` leaves, in units of its usual errors.

    Parameters
    ----------
    masses
        Shape (n,) [kg].
    mode_shapes, angular_frequencies
        Shape (n, r), (r,) [rad/s].
    """
    modes = _all_modes(mode_shapes, angular_frequencies, FREQUENCY_ERROR, SHAPE_ERROR)
    return _updated(np.diag(masses), modes, BOUNDS).cost


def storeys_of(updated: UpdatedModel, bounds: tuple[float, float] = BOUNDS) -> TridiagonalFit:
    """Return an updated storey model as a fit of storeys."""
    storeys = updated.parameters
    low, high = (np.log(value) for value in bounds)
    stuck = np.flatnonzero((np.log(storeys) - low < 1e-6) | (high - np.log(storeys) < 1e-6)) + 1
    return TridiagonalFit(
        storey_stiffnesses=storeys,
        low=updated.low,
        high=updated.high,
        stiffness=updated.stiffness,
        frequency_error=updated.frequency_error,
        at_bound=tuple(int(item) for item in stuck),
        undetermined=tuple(
            i + 1
            for i, name in enumerate(f"storey {k + 1}" for k in range(storeys.size))
            if name in updated.undetermined
        ),
    )


def fit_partial(
    masses: FloatArray, modes: MeasuredModes, possible_numbers: Sequence[tuple[int, int]] = ()
) -> UpdatedModel:
    """Fit the storeys to fewer modes than floors, or to modes that are not measured at all floors.

    If the mode numbers are not given, every possible assignment is fitted, and the best one is taken.

    Parameters
    ----------
    masses
        Shape (n,) [kg]; nan where unknown.
    modes
        The data; its `numbers` count where they are given.
    possible_numbers
        Lowest and highest number (from 1) of each mode.
    """
    floors = masses.size
    known = masses[np.isfinite(masses)]
    typical = float(known.mean()) if known.size else _typical_mass(modes)
    assignments = [modes.numbers] if modes.numbers else _assignments(possible_numbers, floors)
    model = storey_model(floors)
    best: UpdatedModel | None = None
    for numbers in assignments:
        # a uniform chain with the mean mass and the lowest measured frequency
        uniform = eigh(shear_stiffness(np.ones(floors)), eigvals_only=True)
        scales = modes.angular_frequencies**2 * typical / uniform[np.asarray(numbers) - 1]
        start = np.full(floors, float(np.exp(np.mean(np.log(scales)))))
        found = update_model(model, masses, replace(modes, numbers=tuple(numbers)), start, start_mass=typical)
        if best is None or found.cost < best.cost:
            best = found
    if best is None:
        raise ValueError("no assignment of mode numbers is possible")
    if known.size == masses.size:
        return best
    # unknown masses represent what the storeys cannot describe
    return with_jackknife(model, masses, modes, best)


def _typical_mass(modes: MeasuredModes) -> float:
    """Return a first guess of a floor's mass [kg] from the response to a measured force."""
    if modes.scaled_residues is None or not np.isfinite(modes.scaled_residues).any():
        return 1.0
    # the squared mass-normalised shapes of a floor sum to one over its mass
    return 1.0 / max(float(np.nansum(np.maximum(modes.scaled_residues, 0.0))), 1e-300)


def _assignments(possible: Sequence[tuple[int, int]], floors: int) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = [()]
    for low, high in possible:
        found = [
            (*numbers, number)
            for numbers in found
            for number in range(max(low, numbers[-1] + 1 if numbers else 1), min(high, floors) + 1)
        ]
    return found[:_MOST_ASSIGNMENTS]
