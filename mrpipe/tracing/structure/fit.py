"""Fit of linear frame and effects to the equations of motion of the storeys; amplitudes follow by least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy import optimize

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import ComplexArray
from mrpipe.tracing.structure.spectra import Spectra

Base = Literal["shear-frame", "linear-frame"]
_TINY = 1e-9
"""Numerical technique: singular values below this share of the largest one count as zero."""


_LINEAR = 1e-6
"""Numerical technique: a column of which projection leaves a smaller share is linear in the motion; it counts as zero.
"""


@dataclass(frozen=True)
class Columns:
    """Spectral lines of the unit forces of an effect in one record; an amplitude may act on several storeys.

    Attributes
    ----------
    lines
        Shape (k, n, b): amplitude, storey, line; zeros where it does not act.
    """

    lines: ComplexArray


def base_rows(base: Base, spectra: Spectra, storey: int) -> ComplexArray:
    """Return the regressors of a storey, shape (p, b): drift (or all floors), velocities, ground, rotations, loads.

    Only the general linear frame is coupled to the rotations of the floors about the vertical. The equations of modes
    contain their regressors already.
    """
    if spectra.modes is not None:
        return spectra.regressors
    n = spectra.record.floors
    values = spectra.regressors
    displacement, velocity, ground = values[:n], values[n : 2 * n], values[2 * n : 2 * n + 2]
    drift = displacement[storey] - displacement[storey - 1] if storey else displacement[0]
    moved = displacement if base == "linear-frame" else drift[None]
    floors = sorted({*spectra.record.loads, *([1] if "force" in spectra.record.damper else [])})
    acting = [values[2 * n + 2 + k] for k, floor in enumerate(floors) if floor > storey]
    turns = spectra.record.turns
    turned = values[len(values) - 2 * turns :] if turns and base == "linear-frame" else values[:0]
    parts = [moved, velocity, ground, turned]
    if acting:
        parts.append(np.stack(acting))
    return np.concatenate(parts)


def stacked(values: ComplexArray) -> FloatArray:
    """Return real and imaginary parts, concatenated, shape (..., 2 b)."""
    return np.concatenate([values.real, values.imag], axis=-1)


@dataclass(frozen=True)
class Design:
    """The linear model of all storeys over some records, with the projection of effects onto its residual space.

    Attributes
    ----------
    base
        The linear frame.
    spectra
        Spectra of the records.
    residual
        Weighted residual of each storey, shape (n, 2 b).
    basis
        Orthonormal basis of the weighted regressors of each storey, shape (2 b, p).
    solvers
        Pseudo-inverse of the regressors of each storey.
    free
        Number of fitted coefficients.
    """

    base: Base
    spectra: tuple[Spectra, ...]
    residual: FloatArray
    basis: tuple[FloatArray, ...]
    solvers: tuple[FloatArray, ...]
    free: int

    @property
    def size(self) -> int:
        """Number of equations minus number of fitted coefficients."""
        return max(1, self.residual.size - self.free)

    @property
    def chi_square(self) -> float:
        """Mean square of the weighted residual; 1 is noise."""
        return float(np.sum(self.residual**2)) / self.size

    @cached_property
    def linear(self) -> list[FloatArray]:
        """Coefficients of every storey without effects, each of shape (p,)."""
        return coefficients(self, None, np.zeros(0))

    def project(self, columns: Sequence[Columns]) -> FloatArray:
        """Return the weighted columns minus their projection onto the linear model, shape (k, n, 2 b).

        A force that is linear in the motion, such as that of a storey which never yields, leaves zeros instead of
        rounding errors, because these would get an amplitude.
        """
        weighted = weighted_columns(self.spectra, columns)
        for storey, basis in enumerate(self.basis):
            acting = np.flatnonzero(np.any(weighted[:, storey], axis=1))
            own = weighted[acting, storey]
            left = own - (own @ basis) @ basis.T
            linear = np.linalg.norm(left, axis=1) < _LINEAR * np.linalg.norm(own, axis=1)
            weighted[acting, storey] = np.where(linear[:, None], 0.0, left)
        return weighted


def weighted_columns(spectra: Sequence[Spectra], columns: Sequence[Columns]) -> FloatArray:
    """Return columns times weights, with real and imaginary lines of all records concatenated, shape (k, n, 2 b)."""
    parts = [c.lines * s.weight[None] for s, c in zip(spectra, columns, strict=True)]
    return np.concatenate([stacked(part) for part in parts], axis=-1)


def _rows_of(base: Base, spectra: Sequence[Spectra], storey: int, width: int) -> tuple[FloatArray, FloatArray]:
    rows = []
    for item in spectra:
        own = base_rows(base, item, storey)
        # records without a damper or a shaker have no such load: their columns are zero
        full = np.zeros((width, own.shape[1]), dtype=np.complex128)
        full[: len(own)] = own
        rows.append(stacked(full * item.weight[storey]))
    return np.concatenate(rows, axis=-1), _target_of(spectra, storey)


def _target_of(spectra: Sequence[Spectra], storey: int) -> FloatArray:
    return np.concatenate([stacked(item.target[storey] * item.weight[storey]) for item in spectra], axis=-1)


def design_of(base: Base, spectra: Sequence[Spectra]) -> Design:
    """Fit the linear model of every storey by weighted least squares."""
    n = len(spectra[0].target)
    residuals, bases, solvers, free = [], [], [], 0
    width = max(len(base_rows(base, item, 0)) for item in spectra)
    for storey in range(n):
        rows, target = _rows_of(base, spectra, storey, width)
        scale = np.linalg.norm(rows, axis=1)
        scale[scale == 0.0] = 1.0
        left, singular, right = np.linalg.svd((rows / scale[:, None]).T, full_matrices=False)
        kept = singular > _TINY * singular[0]
        basis = np.ascontiguousarray(left[:, kept])
        solvers.append((right[kept].T / singular[kept]) / scale[:, None])
        residuals.append(target - basis @ (basis.T @ target))
        bases.append(basis)
        free += int(kept.sum())
    return Design(base, tuple(spectra), np.stack(residuals), tuple(bases), tuple(solvers), free)


@dataclass(frozen=True)
class Solved:
    """Solution for the amplitudes of columns on a design.

    Attributes
    ----------
    amplitudes
        Shape (k,), none negative.
    residual
        Shape (n, 2 b).
    chi_square
        Mean square of the weighted residual; 1 is noise.
    """

    amplitudes: FloatArray
    residual: FloatArray
    chi_square: float


def solve(design: Design, projected: FloatArray) -> Solved:
    """Return the non-negative amplitudes with the smallest residual; columns have shape (k, n, 2 b)."""
    flat = projected.reshape(len(projected), -1)
    target = design.residual.reshape(-1)
    scale = np.linalg.norm(flat, axis=1)
    alive = scale > 0.0
    amplitudes = np.zeros(len(flat))
    if np.any(alive):
        unit = flat[alive] / scale[alive, None]
        gram, right = unit @ unit.T, unit @ target
        amplitudes[alive] = _non_negative(gram, right) / scale[alive]
    residual = target - amplitudes @ flat
    free = design.free + int(np.count_nonzero(amplitudes))
    chi = float(residual @ residual) / max(1, residual.size - free)
    return Solved(amplitudes, residual.reshape(design.residual.shape), chi)


def _non_negative(gram: FloatArray, right: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(gram)
    values = np.maximum(values, 1e-10)
    root = vectors * np.sqrt(values)
    return np.asarray(optimize.nnls(root.T, (vectors / np.sqrt(values)).T @ right)[0])


def coefficients(design: Design, columns: Sequence[Columns] | None, amplitudes: FloatArray) -> list[FloatArray]:
    """Return the linear coefficients of every storey with the effects at their amplitudes, each of shape (p,)."""
    found = []
    weighted = weighted_columns(design.spectra, columns) if columns is not None else None
    for storey in range(len(design.basis)):
        target = _target_of(design.spectra, storey)
        if weighted is not None:
            target = target - amplitudes @ weighted[:, storey]
        found.append(np.asarray(design.solvers[storey] @ (design.basis[storey].T @ target)))
    return found


def predicted(
    base: Base,
    spectra: Spectra,
    linear: Sequence[FloatArray],
    columns: Columns | None,
    amplitudes: FloatArray,
) -> ComplexArray:
    """Return the predicted lines of every storey's shear force, shape (n, b) [N/sqrt(Hz)]."""
    result = []
    for storey, numbers in enumerate(linear):
        own = base_rows(base, spectra, storey)
        total = numbers[: len(own)] @ own
        if columns is not None:
            total = total + amplitudes @ columns.lines[:, storey]
        result.append(total)
    return np.stack(result)
