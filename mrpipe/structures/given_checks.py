"""What must hold for a structure that a user gives, and what the user should know of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.linalg import eigh

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.structures.dynamics import natural_modes
from mrpipe.structures.frame import Frame

SYMMETRY = 1e-8
"""Largest relative asymmetry of a matrix that is taken for rounding."""

NO_STIFFNESS = 1e-6
"""A natural frequency below this share of the largest one stands for a motion without a restoring force."""

UNIT_FACTORS = (1e-3, 1.0, 1e3, 1e6)
"""Ratios of the units of stiffness and mass: N/m, kN/m and N/mm, MN/m with kg and t."""

SAME_FREQUENCY = 1e-3
"""Relative difference up to which a frequency of the structure is the one that was given."""


def largest_asymmetry(matrix: FloatArray) -> tuple[float, int, int]:
    """Return the largest difference to the mirror image over the largest entry, and its row and column from 1."""
    difference = np.abs(matrix - matrix.T)
    row, column = np.unravel_index(int(np.argmax(difference)), matrix.shape)
    scale = float(np.max(np.abs(matrix)))
    return float(difference[row, column]) / scale if scale > 0.0 else 0.0, int(row) + 1, int(column) + 1


def symmetric(key: str, matrix: FloatArray) -> FloatArray:
    """Return a matrix without the asymmetry of rounding.

    Raises
    ------
    UserError
        If it is not symmetric.
    """
    asymmetry, row, column = largest_asymmetry(matrix)
    if asymmetry > SYMMETRY:
        triangle = not np.any(np.tril(matrix, -1)) or not np.any(np.triu(matrix, 1))
        said = "only one triangle is stored; mirror it" if triangle else "check the export"
        raise UserError(
            "structure",
            f"{key}[{row}, {column}]",
            f"differs from its mirror image by {asymmetry:.1e} of the largest entry",
            f"a mass or stiffness matrix is symmetric; {said}",
        )
    return np.asarray(0.5 * (matrix + matrix.T))


def require_positive_masses(mass: FloatArray) -> None:
    """Refuse a mass matrix that is not positive definite apart from rows of zeros.

    Raises
    ------
    UserError
        If it is not.
    """
    negative = np.flatnonzero(np.diag(mass) < 0.0)
    if negative.size:
        place = int(negative[0]) + 1
        problem = f"is {mass[place - 1, place - 1]:g}, a negative mass"
        raise UserError("structure", f"mass[{place}, {place}]", problem, "correct the sign")
    with_mass = np.any(mass != 0.0, axis=0)
    if not np.any(with_mass) or np.min(np.linalg.eigvalsh(mass[np.ix_(with_mass, with_mass)])) <= 0.0:
        raise UserError(
            "structure",
            "mass",
            "is not positive definite",
            "correct the signs, or remove the degrees of freedom whose masses depend on each other",
        )


def require_restoring_forces(frame: Frame) -> None:
    """Refuse a structure that can move without a restoring force.

    Raises
    ------
    UserError
        If the stiffness is not positive definite.
    """
    squared = eigh(frame.stiffness, frame.mass, eigvals_only=True)
    if np.min(squared) <= NO_STIFFNESS**2 * np.max(np.abs(squared)):
        raise UserError(
            "structure",
            "stiffness",
            "is not positive definite, so the structure can move without a restoring force",
            "add the stiffness of the supports, or correct the signs",
        )


def require_dissipation(damping_ratios: FloatArray) -> None:
    """Refuse a damping matrix that feeds energy into a mode.

    Raises
    ------
    UserError
        If a damping ratio is negative beyond rounding.
    """
    lowest = int(np.argmin(damping_ratios))
    if damping_ratios[lowest] < -1e-9:
        problem = f"gives mode {lowest + 1} the damping ratio {damping_ratios[lowest]:.3g}, so its motion grows"
        raise UserError("structure", "damping", problem, "correct the signs of the damping matrix")


def tell_of_asymmetric_damping(damping: FloatArray, warn: Callable[[str], None] | None) -> None:
    """Warn where the damping matrix is not symmetric."""
    asymmetry, row, column = largest_asymmetry(damping)
    if warn is not None and asymmetry > SYMMETRY:
        warn(
            f"the damping matrix is not symmetric: its entry [{row}, {column}] differs from its mirror image by "
            f"{asymmetry:.1e} of the largest entry. It is used as it is, and the damping ratios are those of its "
            "symmetric part"
        )


def tell_of_equal_matrices(frame: Frame, warn: Callable[[str], None] | None) -> None:
    """Warn where mass and stiffness have the same numbers, up to a decimal factor of their units."""
    if warn is not None and any(np.array_equal(frame.stiffness, factor * frame.mass) for factor in UNIT_FACTORS):
        warn(
            "the stiffness matrix has the same numbers as the mass matrix, so that all natural frequencies are equal: "
            "check that `mass` and `stiffness` do not name the same matrix"
        )


def tell_of_changed_modes(frame: Frame, frequencies_hz: Sequence[float], warn: Callable[[str], None] | None) -> None:
    """Warn where shapes are not orthogonal to the masses, so that the structure has other modes than the given ones."""
    wanted, found = np.sort(frequencies_hz), natural_modes(frame).frequencies_hz
    error = np.abs(found / wanted - 1.0)
    worst = int(np.argmax(error))
    if warn is not None and error[worst] > SAME_FREQUENCY:
        warn(
            f"the mode shapes are not orthogonal to the masses, so that the structure has other modes: mode "
            f"{worst + 1} has {found[worst]:.4g} Hz in place of {wanted[worst]:.4g} Hz"
        )
