"""Frames from modes, from storey stiffnesses, from dimensions, and the sets that come with the program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from mrpipe.artifacts import FloatArray, ParameterSet, load_parameter_set
from mrpipe.errors import UserError
from mrpipe.structures.frame import Frame

_SINGULAR = 1e-8


def mass_matrix(floor_masses: ArrayLike, *, source: str | Path = "frame") -> FloatArray:
    """Return the diagonal mass matrix (3.13), shape (n, n), from masses [kg] of shape (n,), floor 1 first.

    Raises
    ------
    UserError
        If a mass is not a positive number.
    """
    masses = np.atleast_1d(np.asarray(floor_masses, dtype=np.float64))
    wrong = np.flatnonzero(~(np.isfinite(masses) & (masses > 0.0)))
    if wrong.size:
        place = f"floor_masses_kg, floor {wrong[0] + 1}"
        raise UserError(source, place, f"mass is {masses[wrong[0]]:g} kg", "every floor needs a positive mass in kg")
    return np.diag(masses)


def frame_from_modes(
    mode_shapes: ArrayLike,
    angular_frequencies: ArrayLike,
    damping_ratios: ArrayLike,
    floor_masses: ArrayLike,
    *,
    name: str = "frame",
    source: str | Path = "mode matrix",
) -> Frame:
    """Return the frame whose modes are given, by (3.14) to (3.18) of the thesis.

    The modal mass matrix U'MU is taken as diagonal, so stiffness and damping are fully occupied where the shapes are
    not exactly orthogonal.

    Parameters
    ----------
    mode_shapes
        Shape (n, n), one row per floor and one column per mode, with any scaling [1].
    angular_frequencies
        Shape (n,) [rad/s].
    damping_ratios
        Shape (n,) [1].
    floor_masses
        Shape (n,) [kg].
    name, source
        Name and source of the frame, for tables and messages.

    Raises
    ------
    UserError
        If the mode matrix is not square or singular, a mass not positive, or the numbers of modes disagree.
    """
    M = mass_matrix(floor_masses, source=source)
    U = np.asarray(mode_shapes, dtype=np.float64)
    omega = np.asarray(angular_frequencies, dtype=np.float64)
    zeta = np.asarray(damping_ratios, dtype=np.float64)
    n = M.shape[0]
    if U.shape != (n, n) or omega.shape != (n,) or zeta.shape != (n,):
        shape = " x ".join(map(str, U.shape))
        problem = f"mode matrix is {shape}, with {omega.size} frequencies and {zeta.size} damping ratios"
        raise UserError(source, "", problem, f"{n} floors need {n} x {n}, {n} and {n}")
    unit = U / np.linalg.norm(U, axis=0)
    singular = np.linalg.svd(unit, compute_uv=False)
    if not np.all(np.isfinite(unit)) or singular[-1] < _SINGULAR * singular[0]:
        raise UserError(source, "mode matrix", "is singular: two modes have the same shape", "give independent shapes")
    modal_mass = np.diag(U.T @ M @ U)
    inverse = np.linalg.inv(U)
    modal_stiffness = omega**2 * modal_mass
    modal_damping = 2.0 * zeta * np.sqrt(modal_stiffness * modal_mass)
    return Frame(
        mass=M,
        damping=inverse.T @ np.diag(modal_damping) @ inverse,
        stiffness=inverse.T @ np.diag(modal_stiffness) @ inverse,
        name=name,
    )


def shear_stiffness(storey_stiffnesses: ArrayLike) -> FloatArray:
    """Return the tri-diagonal stiffness matrix, shape (n, n) [N/m], of storeys of shape (n,) [N/m], lowest first."""
    storey = np.atleast_1d(np.asarray(storey_stiffnesses, dtype=np.float64))
    above = np.append(storey[1:], 0.0)
    return np.diag(storey + above) - np.diag(storey[1:], 1) - np.diag(storey[1:], -1)


def modal_damping_matrix(mass: FloatArray, stiffness: FloatArray, damping_ratios: ArrayLike) -> FloatArray:
    """Return C [N s/m], shape (n, n), with the given modal damping ratios (n,) on the modes of M and K."""
    squared, shapes = eigh(stiffness, mass)
    omega = np.sqrt(np.maximum(squared, 0.0))
    weighted = mass @ shapes
    zeta = np.broadcast_to(np.asarray(damping_ratios, dtype=np.float64), omega.shape)
    return np.asarray(weighted @ np.diag(2.0 * zeta * omega) @ weighted.T)


def shear_frame(
    floor_masses: ArrayLike,
    storey_stiffnesses: ArrayLike,
    damping_ratios: ArrayLike,
    *,
    name: str = "shear frame",
    source: str | Path = "frame",
) -> Frame:
    """Return a shear frame with modal damping.

    Parameters
    ----------
    floor_masses, storey_stiffnesses
        Shape (n,) [kg], [N/m], lowest first.
    damping_ratios
        Shape (n,) or one number for all modes [1].
    name
        Name of the frame.
    source
        Source of the numbers, for error messages.

    Raises
    ------
    UserError
        If a mass or stiffness is not positive or the numbers disagree.
    """
    M = mass_matrix(floor_masses, source=source)
    storey = np.atleast_1d(np.asarray(storey_stiffnesses, dtype=np.float64))
    if storey.shape != (M.shape[0],):
        raise UserError(
            source, "storey stiffnesses", f"{storey.size} given", f"{M.shape[0]} floors need as many storeys"
        )
    if not np.all(storey > 0.0):
        place = f"storey {int(np.flatnonzero(~(storey > 0.0))[0]) + 1}"
        raise UserError(source, place, "stiffness is not positive", "every storey needs a positive stiffness in N/m")
    K = shear_stiffness(storey)
    return Frame(mass=M, damping=modal_damping_matrix(M, K, damping_ratios), stiffness=K, name=name)


def clamped_column_stiffness(
    elastic_modulus: float, width: float, thickness: float, length: float, columns: int
) -> float:
    """Return the lateral stiffness [N/m] of a storey on columns clamped at both ends: n 12 EI/L3, I = b h3/12."""
    return columns * elastic_modulus * width * thickness**3 / length**3


def p_delta_stiffness(floor_masses: ArrayLike, storey_height: float, gravity: float = 9.81) -> FloatArray:
    """Return the reduction of the stiffness of each storey by gravity [N/m], shape (n,).

    The stiffness of a clamped column of length L under the axial force N is reduced by 6 N/(5 L) (consistent geometric
    stiffness).
    """
    masses = np.asarray(floor_masses, dtype=np.float64)
    carried = np.cumsum(masses[::-1])[::-1] * gravity
    return 1.2 * carried / storey_height


def frame_from_dimensions(values: ParameterSet) -> Frame:
    """Return the shear frame of plates and columns, including the P-delta effect of gravity (errata row 3)."""
    number = {key: values.scalar(key) for key in values.values if key != "damping_ratios"}
    floors, columns = int(number["floors"]), int(number["columns"])
    plate = number["plate_length"] * number["plate_width"] * number["plate_thickness"]
    column = number["column_length"] * number["column_width"] * number["column_thickness"]
    masses = np.full(floors, number["density"] * (plate + columns * column))
    storey = clamped_column_stiffness(
        number["elastic_modulus"], number["column_width"], number["column_thickness"], number["column_length"], columns
    )
    softened = storey - p_delta_stiffness(masses, number["column_length"], number["gravity"])
    return shear_frame(masses, softened, values.values["damping_ratios"], name=values.name, source=values.name)


def frame_from_parameter_set(parameters: ParameterSet | str | Path) -> Frame:
    """Return the frame of a set in `configs/frames` (`thesis`, `thesis-printed`, `geometry`) or of a YAML file.

    Models: `modal-frame` (modes and masses), `shear-frame` (masses, storeys, damping ratios),
    `shear-frame-geometry` (dimensions).

    Raises
    ------
    UserError
        If the set does not exist, its model is unknown, or a value is missing or impossible.
    """
    values = parameters if isinstance(parameters, ParameterSet) else load_parameter_set("frames", parameters)
    entry = values.values
    try:
        if values.model == "modal-frame":
            return frame_from_modes(
                entry["mode_shapes"],
                entry["angular_frequencies"],
                entry["damping_ratios"],
                entry["floor_masses"],
                name=values.name,
                source=f"frame {values.name}",
            )
        if values.model == "shear-frame":
            return shear_frame(
                entry["floor_masses"],
                entry["storey_stiffnesses"],
                entry["damping_ratios"],
                name=values.name,
                source=f"frame {values.name}",
            )
        if values.model == "shear-frame-geometry":
            return frame_from_dimensions(values)
    except KeyError as error:
        raise UserError(
            f"frame {values.name}", f"parameters.{error.args[0]}", "is missing", "give value and unit"
        ) from error
    known = "modal-frame, shear-frame, shear-frame-geometry"
    raise UserError(f"frame {values.name}", "model", f"{values.model!r} is unknown", f"known models: {known}")
