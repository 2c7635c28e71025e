"""A structure from matrices in a file, a storey table, or modes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.errors import UserError
from mrpipe.structures.frame import Frame
from mrpipe.structures.given_checks import (
    require_positive_masses,
    require_restoring_forces,
    symmetric,
    tell_of_asymmetric_damping,
    tell_of_changed_modes,
    tell_of_equal_matrices,
)
from mrpipe.structures.given_units import SI, unit_of_column, warn_of_assumed_units
from mrpipe.structures.options import MatrixEntry, StoreyColumn, StructureSettings
from mrpipe.structures.places import GROUND
from mrpipe.structures.shear_frames import frame_from_modes, frame_from_parameter_set, modal_damping_matrix, shear_frame
from mrpipe.units import conversion, same_unit_dimension
from mrpipe.words import counted

Reader = Callable[[Path, str], Any]
"""Function from a file and the name of a variable (empty: the only table) to the content of the variable."""


def structure_from_settings(
    settings: StructureSettings,
    read: Reader,
    name: str = "structure",
    warn: Callable[[str], None] | None = None,
) -> Frame:
    """Return the structure that the settings describe.

    Parameters
    ----------
    settings
        Exactly one of matrices, storey table and modes.
    read
        Function that reads a variable of a data file.
    name
        Name of the structure.
    warn
        Function that is called with warnings.

    Raises
    ------
    UserError
        If several descriptions are given, sizes disagree, or a matrix is not symmetric and positive definite as
        required.
    """
    ways = {
        "frame": bool(settings.frame),
        "file": bool(settings.file or settings.mass.file or settings.stiffness.file),
        "storeys": bool(settings.storeys),
        "storey_table": settings.storey_table.given,
        "mode_shapes": bool(settings.mode_shapes),
    }
    given = [way for way, there in ways.items() if there]
    if len(given) != 1:
        problem = "describes no structure" if not given else f"describes it {len(given)} times: {', '.join(given)}"
        raise UserError("structure", "", problem, "give frame, matrices (file), storeys, storey_table or mode_shapes")
    if given == ["storeys"]:
        frame = _from_storeys(settings, name)
    elif given == ["storey_table"]:
        frame = _from_table(settings, read, name)
    elif given == ["mode_shapes"]:
        frame = _from_modes(settings, name)
    elif given == ["frame"]:
        frame = frame_from_parameter_set(settings.frame)
    else:
        frame = _from_matrices(settings, read, name)
    full = Frame(
        frame.mass,
        frame.damping,
        frame.stiffness,
        name,
        _influence("influence", settings.influence, frame.floors),
        _names(settings, frame.floors),
        influence_y=_influence("influence_y", settings.influence_y, frame.floors),
    )
    warn_of_assumed_units(settings, warn)
    tell_of_asymmetric_damping(full.damping, warn)
    complete = without_massless(full, warn)
    require_restoring_forces(complete)
    tell_of_equal_matrices(complete, warn)
    if given == ["mode_shapes"]:
        tell_of_changed_modes(complete, settings.frequencies_hz, warn)
    return complete


def _from_storeys(settings: StructureSettings, name: str) -> Frame:
    rows = [row for row in settings.storeys for _ in range(row.repeat)]
    ratios = _ratios(settings, len(rows))
    return shear_frame(
        [row.mass_kg for row in rows], [row.stiffness_n_m for row in rows], ratios, name=name, source="structure"
    )


def _from_table(settings: StructureSettings, read: Reader, name: str) -> Frame:
    table = settings.storey_table
    mass = _column("mass", table.mass, table.file, read, SI["mass"])
    stiffness = _column("stiffness", table.stiffness, table.file, read, SI["stiffness"])
    if len(mass) != len(stiffness):
        raise UserError(
            "structure",
            "storey_table",
            f"has {len(mass)} masses and {len(stiffness)} stiffnesses",
            "give both for each storey",
        )
    return shear_frame(mass, stiffness, _ratios(settings, len(mass)), name=name, source="structure.storey_table")


def _column(key: str, column: StoreyColumn, file: str, read: Reader, si: str) -> FloatArray:
    where = f"structure.storey_table.{key}"
    if column.values:
        values: Any = column.values
    elif file and column.name:
        values = read(Path(file), column.name)
    else:
        raise UserError(where, "", "has neither values nor a column", "give values, or storey_table.file and name")
    try:
        found = np.asarray(values, dtype=np.float64).ravel()
    except (TypeError, ValueError) as error:
        raise UserError(where, column.name, "is not a column of numbers", "name another column") from error
    if not np.all(np.isfinite(found)) or np.any(found <= 0.0):
        row = int(np.flatnonzero(~(np.isfinite(found) & (found > 0.0)))[0])
        raise UserError(where, f"storey {row + 1}", f"is {found[row]:g}", "give a positive number for each storey")
    return found * _factor(unit_of_column(column, where) or si, si, f"{where}.unit")


def _from_modes(settings: StructureSettings, name: str) -> Frame:
    shapes = np.array(settings.mode_shapes, dtype=np.float64)
    n = shapes.shape[0]
    if shapes.shape != (n, n) or len(settings.frequencies_hz) != n or len(settings.masses_kg) != n:
        raise UserError(
            "structure",
            "mode_shapes",
            f"{shapes.shape[0]} rows, {shapes.shape[-1]} columns, {len(settings.frequencies_hz)} frequencies, "
            f"{len(settings.masses_kg)} masses",
            "give as many modes, frequencies and masses as degrees of freedom",
        )
    omega = 2.0 * math.pi * np.array(settings.frequencies_hz)
    return frame_from_modes(
        shapes, omega, _ratios(settings, n), np.array(settings.masses_kg), name=name, source="structure"
    )


def _from_matrices(settings: StructureSettings, read: Reader, name: str) -> Frame:
    mass = _matrix("mass", settings.mass, settings, read, SI["mass"])
    stiffness = _matrix("stiffness", settings.stiffness, settings, read, SI["stiffness"])
    n = mass.shape[0]
    if stiffness.shape != (n, n):
        raise UserError(
            "structure", "stiffness", f"is {_size(stiffness)}, the mass is {_size(mass)}", "give matrices of one size"
        )
    mass, stiffness = symmetric("mass", mass), symmetric("stiffness", stiffness)
    require_positive_masses(mass)
    if settings.damping.name or settings.damping.file:
        damping = _matrix("damping", settings.damping, settings, read, SI["damping"])
        if damping.shape != (n, n):
            raise UserError("structure", "damping", f"is {_size(damping)}", f"give a matrix of {n} x {n}")
    else:
        names = _names(settings, n)
        condensed = without_massless(Frame(mass, np.zeros((n, n)), stiffness, degrees_of_freedom=names))
        damping = np.zeros((n, n))
        with_mass = np.any(mass != 0.0, axis=0)
        damping[np.ix_(with_mass, with_mass)] = modal_damping_matrix(
            condensed.mass, condensed.stiffness, _ratios(settings, condensed.floors)
        )
    return Frame(mass, damping, stiffness, name)


def _matrix(key: str, entry: MatrixEntry, settings: StructureSettings, read: Reader, si: str) -> FloatArray:
    file = entry.file or settings.file
    if not file:
        raise UserError("structure", f"{key}.file", "is not given", "name the file of the matrix, or structure.file")
    content = read(Path(file), entry.name)
    if np.iscomplexobj(content):
        raise UserError(
            file,
            entry.name or key,
            "holds complex numbers",
            "give real matrices; a loss factor of the material is twice the damping ratio at resonance",
        )
    try:
        values = np.asarray(content.toarray() if hasattr(content, "toarray") else content, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UserError(file, entry.name or key, "is not a matrix of numbers", "name another variable") from error
    if values.ndim < 2 or 1 in values.shape:
        # lumped masses are often stored as a column, and a matrix of one entry as a number
        values = np.diag(values.ravel()) if key == "mass" and values.size > 1 else np.atleast_2d(values)
    if values.ndim != 2 or values.shape[0] != values.shape[1]:
        raise UserError(file, entry.name or key, f"has the shape {values.shape}", "give a square matrix")
    if not np.all(np.isfinite(values)):
        row, column = np.argwhere(~np.isfinite(values))[0] + 1
        raise UserError(file, f"{entry.name or key}[{row}, {column}]", "is not finite", "give a finite number")
    return values * _factor(entry.unit or si, si, f"structure.{key}.unit")


def _factor(unit: str, si: str, where: str) -> float:
    """Return the factor from a unit to SI; the unit must have the dimension of the SI one."""
    if not same_unit_dimension(unit, si, where=where):
        raise UserError(where, unit, f"is not a unit of {si}", f"give {si} or a multiple of it")
    return conversion(unit, where=where) / conversion(si, where=where)


def _size(matrix: FloatArray) -> str:
    return f"{matrix.shape[0]} x {matrix.shape[1]}"


def _ratios(settings: StructureSettings, count: int) -> FloatArray:
    given = list(settings.damping_ratio)
    if len(given) > count:
        problem = f"has {len(given)} entries, and the structure has {count} modes"
        raise UserError("structure", "damping_ratio", problem, "give one for each mode, or fewer")
    return np.array(given + [given[-1]] * (count - len(given)))


def _influence(key: str, values: Sequence[float], count: int) -> FloatArray | None:
    if not values:
        return None
    return np.array(as_many(key, values, count))


def _names(settings: StructureSettings, count: int) -> tuple[str, ...]:
    names = (
        tuple(as_many("degrees_of_freedom", settings.degrees_of_freedom, count)) if settings.degrees_of_freedom else ()
    )
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise UserError("structure", "degrees_of_freedom", f"{twice} occurs more than once", "give different names")
    for place, name in enumerate(names, start=1):
        where = f"degrees_of_freedom[{place - 1}]"
        if name in GROUND:
            raise UserError("structure", where, f"is called {name}, which means the ground", "choose another name")
        if name.isdigit() and name != str(place):
            problem = f"is called {name}, which also means the degree of freedom number {name}"
            raise UserError("structure", where, problem, f"call it {place}, or give it a word")
    return names


def as_many(key: str, values: Sequence[Any], count: int) -> Sequence[Any]:
    """Return the values of a setting, of which there must be one for each degree of freedom.

    Raises
    ------
    UserError
        If there are more or fewer.
    """
    if len(values) != count:
        problem = f"has {len(values)} {'entry' if len(values) == 1 else 'entries'}"
        raise UserError("structure", key, problem, f"the structure has {counted(count, 'degree')} of freedom")
    return values


def without_massless(frame: Frame, warn: Callable[[str], None] | None = None) -> Frame:
    """Return the structure without its degrees of freedom that have no mass.

    Their static condensation is exact, because only springs act on them. Dashpots on them must be proportional to the
    springs, as with damping proportional to the stiffness.

    Parameters
    ----------
    frame
        The structure.
    warn
        Function that is called with the names of the removed degrees of freedom.

    Raises
    ------
    UserError
        If a degree of freedom has neither mass nor stiffness.
    """
    keep = np.any(frame.mass != 0.0, axis=0)
    if np.all(keep):
        return frame
    places, gone = np.flatnonzero(keep), np.flatnonzero(~keep)
    inner = frame.stiffness[np.ix_(gone, gone)]
    if np.linalg.matrix_rank(inner) < len(gone):
        nowhere = ", ".join(frame.names[place] for place in gone[:6])
        raise UserError("structure", nowhere, "has neither mass nor a spring", "remove it, or give it a mass")
    static = np.asarray(-np.linalg.solve(inner, frame.stiffness[np.ix_(gone, places)]), dtype=np.float64)
    basis = np.zeros((frame.floors, len(places)))
    basis[places] = np.eye(len(places))
    basis[gone] = static
    mass, damping, stiffness = (basis.T @ item @ basis for item in (frame.mass, frame.damping, frame.stiffness))
    if warn is not None:
        warn(_condensed(frame, places, gone, static))
    return replace(
        frame,
        mass=mass,
        damping=damping,
        stiffness=0.5 * (stiffness + stiffness.T),
        influence=None if frame.influence is None else frame.influence[places],
        influence_y=None if frame.influence_y is None else frame.influence_y[places],
        degrees_of_freedom=tuple(frame.names[place] for place in places),
    )


def _condensed(frame: Frame, places: IntArray, gone: IntArray, static: FloatArray) -> str:
    """Return a sentence that says what was condensed, and whether that is exact."""
    names = [frame.names[place] for place in gone]
    listed = ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")
    count = f"{counted(len(names), 'degree')} of freedom without mass"
    # forces of the dashpots on them while they follow statically
    left = frame.damping[np.ix_(gone, places)] + frame.damping[np.ix_(gone, gone)] @ static
    if np.max(np.abs(left)) > 1e-6 * max(float(np.max(np.abs(frame.damping))), 1e-300):
        return (
            f"{count} ({listed}) had to be condensed. This is an approximation, because the dashpots there are not "
            "proportional to the springs. Give a mass there if these dashpots matter"
        )
    return f"{count} ({listed}) had to be condensed. This is exact"


def floor_heights(settings: StructureSettings, read: Reader) -> list[float] | None:
    """Return the height of each floor above the ground [m]; None if a storey has no height."""
    column = settings.storey_table.height
    if settings.storey_table.given and (column.name or column.values):
        storeys = _column("height", column, settings.storey_table.file, read, SI["height"])
        floors = _column("mass", settings.storey_table.mass, settings.storey_table.file, read, SI["mass"]).size
        if storeys.size != floors:
            problem = f"has {storeys.size} values, and the table has {floors} storeys"
            raise UserError("structure.storey_table", "height", problem, "give the height of each storey")
        return [float(height) for height in np.cumsum(storeys)]
    heights = [row.height_m for row in settings.storeys for _ in range(row.repeat)]
    known = [height for height in heights if height is not None]
    return np.cumsum(known).tolist() if heights and len(known) == len(heights) else None
