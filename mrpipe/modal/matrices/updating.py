"""Updating of a structural model: parameters of the stiffness matrix fitted to measured modes, with intervals.

K(p) = K0 + p_1 K_1 + p_2 K_2 + ... with positive parameters p: storeys, connection springs, or any matrices a user
gives. The modes may be fewer than the degrees of freedom, and some degrees of freedom may have no sensor. Masses that
are not known are parameters as well where the modes are scaled, that is, where a measured force excited them.

The intervals of a least-squares fit are valid if the model is correct and the errors are independent. A structure has
stiffness that the model lacks, and sensors also measure other directions. Such errors are correlated over the rows of a
mode. Fits that leave out one mode each (jackknife; Efron and Tibshirani 1993, An Introduction to the Bootstrap, chapter
11) show their effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray

_NORMAL_95 = 1.959964
_UNDETERMINED = 0.5
"""Half width of an interval, in logarithms, above which the data do not determine a parameter."""
_RANGE = 8.0
"""Parameters may differ from their start by this factor in logarithms."""
_FEWEST_MODES = 3
"""Least number of modes for the jackknife, because one of them is left out in each fit."""


@dataclass(frozen=True)
class StiffnessModel:
    """A stiffness matrix with unknown positive parameters.

    Attributes
    ----------
    parts
        Shape (p, n, n): derivative of K by each parameter.
    names
        Name of each parameter.
    base
        Shape (n, n): part of K that is known [N/m].
    """

    parts: FloatArray
    names: tuple[str, ...]
    base: FloatArray

    def stiffness(self, parameters: FloatArray) -> FloatArray:
        """Return K, shape (n, n) [N/m]."""
        return np.asarray(self.base + np.tensordot(parameters, self.parts, axes=1))


def storey_model(floors: int) -> StiffnessModel:
    """Return the model of a shear frame: one stiffness a storey, lowest first."""
    parts = np.zeros((floors, floors, floors))
    for storey in range(floors):
        drift = np.zeros(floors)
        drift[storey] = 1.0
        if storey:
            drift[storey - 1] = -1.0
        parts[storey] = np.outer(drift, drift)
    return StiffnessModel(parts, tuple(f"storey {i + 1}" for i in range(floors)), np.zeros((floors, floors)))


@dataclass(frozen=True)
class MeasuredModes:
    """Modes as data of an update.

    Attributes
    ----------
    angular_frequencies
        Shape (r,) [rad/s].
    shapes
        Shape (s, r), any scaling.
    rows
        Degree of freedom (from 0) of each row of `shapes`.
    numbers
        Number (from 1) of each mode among those of the model; empty: the fit determines it.
    scaled_residues
        Shape (r,) [1/kg]: acceleration over force at the degree of freedom `driven`, nan where unknown.
    driven
        Degree of freedom (from 0) where the measured force acts; -1 if there is none.
    frequency_error, shape_error, scale_error
        Standard errors for the weights: relative; of a shape of unit norm; relative, one for all modes or shape (r,).
    """

    angular_frequencies: FloatArray
    shapes: FloatArray
    rows: tuple[int, ...]
    numbers: tuple[int, ...] = ()
    scaled_residues: FloatArray | None = None
    driven: int = -1
    frequency_error: float = 1e-3
    shape_error: float = 2e-2
    scale_error: float | FloatArray = 0.05

    def without(self, mode: int) -> MeasuredModes:
        """Return the data without one mode, by its place (from 0)."""
        kept = [place for place in range(self.angular_frequencies.size) if place != mode]
        scale = self.scaled_residues
        error = np.broadcast_to(self.scale_error, self.angular_frequencies.shape)[kept]
        return replace(
            self,
            angular_frequencies=self.angular_frequencies[kept],
            shapes=self.shapes[:, kept],
            numbers=tuple(self.numbers[place] for place in kept) if self.numbers else (),
            scaled_residues=None if scale is None else scale[kept],
            scale_error=error,
        )


@dataclass(frozen=True)
class UpdatedModel:
    """Result of :func:`update_model`.

    Attributes
    ----------
    parameters, low, high
        Values and 95 % intervals, shape (p,).
    masses, mass_low, mass_high
        Lumped masses and their intervals, shape (n,) [kg]; an interval of zero width where the mass was given.
    stiffness
        Shape (n, n) [N/m].
    numbers
        Mode number (from 1) of each measured mode.
    frequency_error
        Model over measured, minus one, shape (r,).
    undetermined
        Names of the parameters whose interval is wider than half of their value.
    cost
        Sum of squares of the weighted residual.
    """

    parameters: FloatArray
    low: FloatArray
    high: FloatArray
    masses: FloatArray
    mass_low: FloatArray
    mass_high: FloatArray
    stiffness: FloatArray
    numbers: tuple[int, ...]
    frequency_error: FloatArray
    undetermined: tuple[str, ...]
    cost: float


class _Problem:
    """Residual of the measured modes for parameters theta = (ln p, ln unknown masses)."""

    def __init__(self, model: StiffnessModel, masses: FloatArray, modes: MeasuredModes, numbers: Sequence[int]) -> None:
        self.model, self.masses, self.modes = model, masses, modes
        self.index = np.asarray(numbers, dtype=np.int64) - 1
        self.unknown = np.flatnonzero(~np.isfinite(masses))
        self.rows = list(modes.rows)

    def split(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        count = len(self.model.names)
        masses = self.masses.copy()
        masses[self.unknown] = np.exp(theta[count:])
        return np.exp(theta[:count]), masses

    def model_modes(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return angular frequencies (r,) and mass-normalised shapes (n, r) of the numbered modes."""
        parameters, masses = self.split(theta)
        root = 1.0 / np.sqrt(masses)
        squared, vectors = eigh(self.model.stiffness(parameters) * np.outer(root, root))
        return np.sqrt(np.maximum(squared[self.index], 1e-30)), root[:, None] * vectors[:, self.index]

    def residual(self, theta: FloatArray) -> FloatArray:
        modes = self.modes
        omega, shapes = self.model_modes(theta)
        # known masses weight the floors of a shape; unknown ones must not, because the weights would depend on the
        # parameters
        weight = np.ones(len(self.rows)) if self.unknown.size else np.sqrt(self.masses[self.rows])
        model = weight[:, None] * shapes[self.rows]
        model = model / np.maximum(np.linalg.norm(model, axis=0), 1e-300)
        measured = weight[:, None] * modes.shapes
        measured = measured / np.linalg.norm(measured, axis=0)
        turned = model * np.where(np.sum(model * measured, axis=0) < 0.0, -1.0, 1.0)
        frequency = np.log(omega) - np.log(modes.angular_frequencies)
        parts = [frequency / modes.frequency_error, ((turned - measured) / modes.shape_error).ravel()]
        if modes.scaled_residues is not None and modes.driven >= 0:
            known = np.isfinite(modes.scaled_residues) & (modes.scaled_residues > 0.0)
            own = np.maximum(shapes[modes.driven, known] ** 2, 1e-300)
            error = np.broadcast_to(modes.scale_error, known.shape)[known]
            parts.append(0.5 * (np.log(own) - np.log(modes.scaled_residues[known])) / error)
        return np.concatenate(parts)


def update_model(
    model: StiffnessModel,
    masses: FloatArray,
    modes: MeasuredModes,
    start: FloatArray,
    *,
    start_mass: float | FloatArray = 1.0,
    bounds: tuple[float, float] | None = None,
) -> UpdatedModel:
    """Fit the parameters of a stiffness matrix to measured modes by least squares.

    Parameters
    ----------
    model
        The stiffness matrix.
    masses
        Lumped masses, shape (n,) [kg]; nan where unknown.
    modes
        The data.
    start
        First guess of the parameters, shape (p,).
    start_mass
        First guess of unknown masses, one for all or shape (n,) [kg].
    bounds
        Bounds of each parameter; a wide range around the start if left out.
    """
    problem = _Problem(model, masses, modes, modes.numbers)
    theta = np.concatenate([np.log(start), np.log(np.broadcast_to(start_mass, masses.shape)[problem.unknown])])
    low, high = theta - _RANGE, theta + _RANGE
    if bounds is not None:
        low[: start.size], high[: start.size] = np.log(bounds[0]), np.log(bounds[1])
    margin = 1e-9 * (high - low)
    first = np.clip(theta, low + margin, high - margin)
    result = least_squares(problem.residual, first, bounds=(low, high), x_scale="jac")
    return _collect(problem, np.asarray(result.x), np.asarray(result.jac), float(2.0 * result.cost))


def with_jackknife(
    model: StiffnessModel, masses: FloatArray, modes: MeasuredModes, found: UpdatedModel
) -> UpdatedModel:
    """Return an updated model with intervals that include errors which are correlated within a mode (jackknife).

    Parameters
    ----------
    model, masses, modes
        As for :func:`update_model`.
    found
        Result of :func:`update_model`; its intervals are kept where they are wider. With fewer than three modes it is
        returned unchanged.
    """
    count = modes.angular_frequencies.size
    if count < _FEWEST_MODES:
        return found
    numbered = replace(modes, numbers=found.numbers)
    fits = [
        update_model(model, masses, numbered.without(mode), found.parameters, start_mass=found.masses)
        for mode in range(count)
    ]
    spread = _jackknife([item.parameters for item in fits])
    mass_spread = _jackknife([item.masses for item in fits])
    names = [*model.names, *(f"mass {row + 1}" for row in range(masses.size))]
    wide = np.concatenate([spread, mass_spread]) > _UNDETERMINED
    return replace(
        found,
        low=np.minimum(found.low, found.parameters * np.exp(-spread)),
        high=np.maximum(found.high, found.parameters * np.exp(spread)),
        mass_low=np.minimum(found.mass_low, found.masses * np.exp(-mass_spread)),
        mass_high=np.maximum(found.mass_high, found.masses * np.exp(mass_spread)),
        undetermined=tuple(
            name for name, open_ in zip(names, wide, strict=True) if open_ or name in found.undetermined
        ),
    )


def _jackknife(values: Sequence[FloatArray]) -> FloatArray:
    """Return the half widths of 95 % intervals of logarithms from fits that each leave one mode out."""
    logs = np.log(np.stack(values))
    squares = np.sum((logs - logs.mean(axis=0)) ** 2, axis=0)
    return np.asarray(np.minimum(_NORMAL_95 * np.sqrt((len(logs) - 1) / len(logs) * squares), _RANGE))


def _collect(problem: _Problem, theta: FloatArray, jacobian: FloatArray, cost: float) -> UpdatedModel:
    parameters, masses = problem.split(theta)
    covariance = np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-12)
    freedom = max(1, jacobian.shape[0] - theta.size)
    spread = _NORMAL_95 * np.sqrt(np.diag(covariance) * max(cost / freedom, 1e-30))
    # directions that the data do not determine have no variance in the pseudo-inverse: their parameters are unknown
    rows = np.zeros((max(0, theta.size - jacobian.shape[0]), theta.size))
    _, singular, right = np.linalg.svd(np.vstack([jacobian, rows]), full_matrices=False)
    blind = right[singular < 1e-6 * singular[0]]
    spread = np.where(np.any(np.abs(blind) > 0.1, axis=0), _RANGE, spread) if blind.size else spread
    spread = np.minimum(spread, _RANGE)
    count = parameters.size
    mass_spread = np.zeros(masses.size)
    mass_spread[problem.unknown] = spread[count:]
    names = [*problem.model.names, *(f"mass {i + 1}" for i in problem.unknown)]
    omega = problem.model_modes(theta)[0]
    return UpdatedModel(
        parameters=parameters,
        low=parameters * np.exp(-spread[:count]),
        high=parameters * np.exp(spread[:count]),
        masses=masses,
        mass_low=masses * np.exp(-mass_spread),
        mass_high=masses * np.exp(mass_spread),
        stiffness=problem.model.stiffness(parameters),
        numbers=tuple(int(i) + 1 for i in problem.index),
        frequency_error=omega / problem.modes.angular_frequencies - 1.0,
        undetermined=tuple(name for name, width in zip(names, spread, strict=True) if width > _UNDETERMINED),
        cost=cost,
    )
