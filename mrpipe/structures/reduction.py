"""Reduction of a large structure: static condensation, Craig-Bampton, modal and balanced truncation.

All methods return a structure with M, C, K and an influence vector. The error of a reduction is the largest deviation
of the frequency response to ground motion, at the retained degrees of freedom, relative to the largest response.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, eigh, null_space, solve_continuous_lyapunov, solve_triangular

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.structures.dynamics import StateSpace, natural_modes, state_space
from mrpipe.structures.frame import Frame
from mrpipe.structures.options import ReductionSettings
from mrpipe.structures.places import degree_of_freedom

WORST_CONDITION = 1e6
"""Shapes at the places to keep with a larger condition number do not determine the amplitudes of the modes."""

NO_MOTION = 1e-9
"""Response of the places over that of the whole structure below which it is a rounding error."""

BEYOND_FIRST = 1.5
"""The error of a reduction is stated at least up to this multiple of the first natural frequency."""


@dataclass(frozen=True)
class Reduced:
    """Reduced structure and the error of the reduction.

    Attributes
    ----------
    frame
        The reduced structure, coordinates q.
    basis
        Transformation T from reduced to full coordinates, x = T q, shape (n, m).
    kept
        Indices of the retained physical degrees of freedom, in the order of the first coordinates; empty: none.
    error
        Largest relative error of the frequency response over the band [1].
    band_high_hz
        Highest frequency of the band [Hz].
    """

    frame: Frame
    basis: FloatArray
    kept: tuple[int, ...]
    error: float
    band_high_hz: float


def guyan(frame: Frame, kept: Sequence[int], band_high_hz: float | None = None) -> Reduced:
    """Condense a structure statically onto some of its degrees of freedom (Guyan 1965).

    Parameters
    ----------
    frame
        Structure.
    kept
        Indices of the degrees of freedom that stay, from 0.
    band_high_hz
        Up to where the error is stated; None: half the last natural frequency of the reduced structure, and at least
        1.5 times its first one.
    """
    kept, others = _partition(frame, kept)
    basis = np.zeros((frame.floors, len(kept)))
    basis[kept] = np.eye(len(kept))
    basis[others] = -np.linalg.solve(frame.stiffness[np.ix_(others, others)], frame.stiffness[np.ix_(others, kept)])
    return _projected(frame, basis, kept, band_high_hz)


def craig_bampton(frame: Frame, kept: Sequence[int], modes: int, band_high_hz: float | None = None) -> Reduced:
    """Reduce a structure to interface degrees of freedom and fixed-interface modes (Craig and Bampton 1968).

    Parameters
    ----------
    frame
        Structure.
    kept
        Indices of the interface degrees of freedom, from 0.
    modes
        Number of fixed-interface modes.
    band_high_hz
        Up to where the error is stated; None: as in :func:`guyan`.
    """
    kept, others = _partition(frame, kept)
    modes = min(modes, len(others))
    static = guyan(frame, kept, 1.0).basis
    _, shapes = eigh(frame.stiffness[np.ix_(others, others)], frame.mass[np.ix_(others, others)])
    basis = np.zeros((frame.floors, len(kept) + modes))
    basis[:, : len(kept)] = static
    basis[np.ix_(others, range(len(kept), len(kept) + modes))] = shapes[:, :modes]
    return _projected(frame, basis, kept, band_high_hz)


def modal(frame: Frame, modes: int, kept: Sequence[int] = (), band_high_hz: float | None = None) -> Reduced:
    """Retain the lowest modes; with as many `kept` degrees of freedom as modes, in physical coordinates.

    Parameters
    ----------
    frame
        Structure.
    modes
        Number of modes.
    kept
        Degrees of freedom that become the coordinates (SEREP, O'Callahan 1989); empty: modal coordinates.
    band_high_hz
        Up to where the error is stated; None: the frequency of the last mode kept.
    """
    found = natural_modes(frame)
    modes = min(modes, frame.floors)
    shapes = found.mode_shapes[:, :modes]
    if band_high_hz is None:
        band_high_hz = float(found.angular_frequencies[modes - 1]) / (2.0 * math.pi)
    if not kept:
        return _projected(frame, shapes, [], band_high_hz)
    if len(kept) != modes:
        raise UserError(
            "structure.reduction", "keep", f"has {len(kept)} entries", f"give as many as modes, which are {modes}"
        )
    rows = shapes[list(kept)]
    if np.linalg.cond(rows) > WORST_CONDITION:
        names = ", ".join(frame.names[place] for place in kept)
        problem = f"{names} cannot tell the {modes} lowest modes apart"
        raise UserError("structure.reduction", "keep", problem, "keep other degrees of freedom, or use craig-bampton")
    return _projected(frame, shapes @ np.linalg.inv(rows), list(kept), band_high_hz)


def balanced_structure(
    frame: Frame, kept: Sequence[int], coordinates: int, band_high_hz: float | None = None
) -> Reduced:
    """Retain the shapes that ground motion and forces on `kept` excite most: balanced truncation of M, C and K.

    For symmetric M, C and K and outputs at the places of the forces, the position part of the controllability Gramian
    and the velocity part of the observability Gramian are equal in the inner product of the mass. Both are diagonal in
    the eigenvectors of the former, and the truncation is a projection that keeps the structure symmetric and stable
    (position-velocity balancing: Meyer and Srinivasan 1996; Reis and Stykel 2008). The basis is rotated so that its
    first coordinates are the displacements of `kept`.

    Parameters
    ----------
    frame
        Structure; all modes need damping.
    kept
        Indices of the degrees of freedom whose forces and displacements are inputs and outputs, from 0.
    coordinates
        Number of coordinates of the reduced structure, at least as many as `kept`.
    band_high_hz
        Up to where the error is stated; None: as in :func:`guyan`.

    Raises
    ------
    UserError
        If there are fewer coordinates than places to keep, or a mode has no damping.
    """
    kept, _ = _partition(frame, kept)
    coordinates = min(coordinates, frame.floors)
    if coordinates < len(kept):
        problem = f"is {coordinates}, and keep has {len(kept)} entries"
        raise UserError("structure.reduction", "modes", problem, "give at least as many as degrees of freedom to keep")
    forces = np.eye(frame.floors)[:, kept]
    motions = [frame.mass @ vector for vector in (frame.ground_influence, frame.influence_y) if vector is not None]
    loads = np.column_stack([*motions, forces])
    # the inputs are scaled such that each alone stores the same static energy, so that the result does not depend on
    # their units
    loads /= np.sqrt(np.einsum("ni,ni->i", loads, np.linalg.solve(frame.stiffness, loads)))
    space = state_space(frame, loads)
    _require_stable(space)
    B = space.B[:, 1:]
    gramian = solve_continuous_lyapunov(space.A, -B @ B.T)[: frame.floors, : frame.floors]
    # the eigenvectors of P M, by its symmetric form L' P L with M = L L'
    lower = cholesky(frame.mass, lower=True)
    sizes, vectors = eigh(lower.T @ gramian @ lower)
    shapes = solve_triangular(lower.T, vectors[:, np.argsort(sizes)[::-1]][:, :coordinates])
    rows = shapes[kept]
    inner = np.asarray(null_space(rows)) if coordinates > len(kept) else np.zeros((coordinates, 0))
    basis = shapes @ np.column_stack([np.linalg.pinv(rows), inner])
    return _projected(frame, basis, kept, band_high_hz)


def require_keep(settings: ReductionSettings) -> None:
    """Refuse a reduction that keeps no degree of freedom.

    Raises
    ------
    UserError
        If that is so.
    """
    if not settings.keep:
        raise UserError(
            "structure.reduction",
            "keep",
            "is empty, so the damper could not be attached",
            "name at least the degrees of freedom of the damper and of the sensors",
        )


def reduced_structure(frame: Frame, settings: ReductionSettings) -> Reduced:
    """Reduce a structure with the settings; without a reduction coordinates and response are unchanged.

    Raises
    ------
    UserError
        If a degree of freedom in `keep` does not exist, or `keep` is empty.
    """
    high = settings.band_high_hz
    if settings.method == "none":
        everything = tuple(range(frame.floors))
        return Reduced(frame, np.eye(frame.floors), everything, 0.0, high or 0.0)
    require_keep(settings)
    # in the order of the structure, because results call the last one the top
    kept = sorted(degree_of_freedom(frame, name, "structure.reduction.keep") for name in settings.keep)
    if settings.method == "guyan":
        return guyan(frame, kept, high)
    if settings.method == "craig-bampton":
        return craig_bampton(frame, kept, settings.modes, high)
    if settings.method == "balanced":
        return balanced_structure(frame, kept, settings.modes, high)
    return modal(frame, settings.modes, kept, high)


def _require_stable(space: StateSpace) -> None:
    poles = np.linalg.eigvals(space.A)
    if np.max(poles.real) >= -1e-9 * np.max(np.abs(poles)):
        raise UserError(
            "structure.reduction",
            "method",
            "balanced truncation needs a stable structure with damping",
            "give a positive damping ratio, or use craig-bampton",
        )


def frequency_error(frame: Frame, reduced: Frame, basis: FloatArray, places: Sequence[int], high_hz: float) -> float:
    """Return the largest error of the response to ground motion from 0 to `high_hz`, relative to the largest response.

    Of two directions of the ground the worse one counts; one that does not move the places is left out. Where none
    moves them, the response is that to a force on all places. The lines lie at the natural frequencies and between
    them, because a resonance is narrow.
    """
    omega = natural_modes(frame).angular_frequencies
    omega = omega[(omega > 0.0) & (omega <= 2.0 * math.pi * high_hz)]
    between = np.linspace(0.0, 2.0 * math.pi * high_hz, 200)[1:]
    lines = np.unique(np.concatenate([omega, between]))
    rows = list(places) if len(places) else list(range(frame.floors))
    directions = (frame.ground_influence, frame.influence_y)
    loads = [-(frame.mass @ vector) for vector in directions if vector is not None]
    errors = [_error(frame, reduced, basis, load, rows, lines) for load in loads]
    if all(error is None for error in errors):
        load = np.zeros(frame.floors)
        load[rows] = 1.0
        errors = [_error(frame, reduced, basis, load, rows, lines)]
    return max(error for error in errors if error is not None)


def _error(
    frame: Frame, reduced: Frame, basis: FloatArray, load: FloatArray, rows: list[int], lines: FloatArray
) -> float | None:
    """Return the largest error in the rows over the largest response there; None if the load does not move them."""
    full = _response(frame, lines, load)
    small = _response(reduced, lines, basis.T @ load) @ basis.T
    size = float(np.max(np.abs(full[:, rows])))
    if size <= NO_MOTION * float(np.max(np.abs(full))):
        return None
    return float(np.max(np.abs(full - small)[:, rows])) / size


def _response(
    frame: Frame, omega: FloatArray, load: FloatArray
) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
    force = load.astype(np.complex128)
    return np.array([
        np.linalg.solve(frame.stiffness + 1j * w * frame.damping - w**2 * frame.mass, force) for w in omega
    ])  # fmt: skip


def _partition(frame: Frame, kept: Sequence[int]) -> tuple[list[int], list[int]]:
    if not 0 < len(set(kept)) < frame.floors or len(set(kept)) != len(kept):
        raise UserError(
            "structure.reduction",
            "keep",
            f"{len(kept)} of {frame.floors} degrees of freedom, each once",
            "keep at least one and not all, each once",
        )
    return list(kept), [k for k in range(frame.floors) if k not in set(kept)]


def _projected(frame: Frame, basis: FloatArray, kept: Sequence[int], band_high_hz: float | None) -> Reduced:
    mass, stiffness = (basis.T @ matrix @ basis for matrix in (frame.mass, frame.stiffness))
    mass, stiffness = 0.5 * (mass + mass.T), 0.5 * (stiffness + stiffness.T)
    damping = basis.T @ frame.damping @ basis
    # the load of the ground motion is projected; with the reduced mass it defines the influence vector
    influence, influence_y = (
        None if vector is None else np.asarray(np.linalg.solve(mass, basis.T @ frame.mass @ vector), dtype=np.float64)
        for vector in (frame.ground_influence, frame.influence_y)
    )
    names = tuple(frame.names[k] for k in kept)
    modes = basis.shape[1] - len(kept)
    names += tuple(f"mode {k + 1}" for k in range(modes))
    reduced = Frame(mass, damping, stiffness, f"{frame.name}, reduced", influence, names, modes, influence_y)
    if band_high_hz is None:
        omega = natural_modes(reduced).angular_frequencies
        # below the first resonance every reduction is good
        band_high_hz = max(0.5 * float(omega[-1]), BEYOND_FIRST * float(omega[0])) / (2.0 * math.pi)
    error = frequency_error(frame, reduced, basis, kept, band_high_hz)
    return Reduced(reduced, basis, tuple(kept), error, band_high_hz)
