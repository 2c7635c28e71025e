"""Floors that move as rigid plates: two translations and a rotation, from sensors at known positions.

A sensor along x at the place (px, py) measures u_x - py * rotation, a sensor along y measures u_y + px * rotation. With
three sensors, of which two are parallel at a distance, the three motions of the floor follow by least squares.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.matrices.assembly import Assembly
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.checks import orthogonal_shapes
from mrpipe.structures import Frame, modal_damping_matrix, normalise_to_largest
from mrpipe.structures.response import band_limited_response
from mrpipe.words import in_percent

AXES = ("x", "y", "rotation")
_LARGEST_MISFIT = 0.1
_LARGEST_CONDITION = 1e6


@dataclass(frozen=True)
class RigidShapes:
    """Mode shapes of rigid floors.

    Attributes
    ----------
    shapes, errors
        Shape (3 n, r): x, y and rotation of floor 1, then of floor 2; rotations in 1/m relative to translations.
    names
        Name of each row.
    misfit
        Shape (r,): part of the measured shape that no motion of rigid floors explains, over the shape.
    """

    shapes: FloatArray
    errors: FloatArray
    names: tuple[str, ...]
    misfit: FloatArray


def _row(direction: str, place: tuple[float, float]) -> tuple[float, float, float]:
    return (1.0, 0.0, -place[1]) if direction.startswith("x") else (0.0, 1.0, place[0])


def measured_rows(
    places: Sequence[tuple[int, str]], positions: Mapping[str, tuple[float, float]], floors: int
) -> FloatArray:
    """Return the matrix from the motions of rigid floors to the measured motions, shape (places, 3 n).

    The same row distributes the force of a shaker at this position over the degrees of freedom (principle of virtual
    work).

    Parameters
    ----------
    places
        (floor from 1, direction) of each sensor.
    positions
        Direction -> place on the floor relative to the centre of mass [m].
    floors
        Number of floors n.
    """
    rows = np.zeros((len(places), 3 * floors))
    for row, (floor, direction) in zip(rows, places, strict=True):
        row[3 * floor - 3 : 3 * floor] = _row(direction, positions[direction])
    return rows


def rigid_response(
    frame: Frame, test: FrameTest, positions: Mapping[str, tuple[float, float]], highest_hz: float
) -> FloatArray:
    """Return the simulated response of the sensors of a forced test, shape (m, s) [m/s2] or [m].

    Parameters
    ----------
    frame
        Three degrees of freedom a floor: x, y and rotation.
    test
        A test with a measured excitation of the ground or of shakers.
    positions
        Positions of the sensors, see :func:`measured_rows`.
    highest_hz
        Highest frequency of interest [Hz].
    """
    floors = frame.floors // 3
    rows = measured_rows([(sensor.floor, sensor.direction) for sensor in test.sensors], positions, floors)
    flags = np.asarray(test.is_displacement)
    simulated = np.zeros(test.responses.shape)
    for place, values in test.inputs.items():
        force = None if place.floor == 0 else measured_rows([place], positions, floors)[0]
        moved = replace(frame, influence=ground_influence(floors, place.direction)) if force is None else frame
        values, dt = values - values.mean(), 1.0 / test.sampling_rate_hz
        found = band_limited_response(moved, values, dt, highest_hz, force_position=force)
        simulated += np.where(flags, found.displacement @ rows.T, found.absolute_acceleration @ rows.T)
    return simulated


def ground_influence(floors: int, axis: str) -> FloatArray:
    """Return the displacement of each degree of freedom when the ground moves by 1 m along an axis, shape (3 n,)."""
    return np.tile([0.0, 1.0, 0.0] if axis.startswith("y") else [1.0, 0.0, 0.0], floors)


def rigid_shapes(fit: MultiModeFit, positions: Mapping[str, tuple[float, float]], source: Path) -> RigidShapes:
    """Return translations and rotation of each floor in each mode.

    Raises
    ------
    UserError
        If the sensors of a floor do not determine its three motions.
    """
    floors = sorted({sensor.floor for sensor in fit.sensors})
    modes = fit.residues.shape[1]
    shapes, errors = np.empty((3 * len(floors), modes)), np.empty((3 * len(floors), modes))
    rest = np.zeros(modes)
    values, spread = fit.residues.real, fit.residue_errors
    for index, floor in enumerate(floors):
        rows = [i for i, sensor in enumerate(fit.sensors) if sensor.floor == floor]
        matrix = np.array([_row(fit.sensors[i].direction, positions[fit.sensors[i].direction]) for i in rows])
        size = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        if len(rows) < 3 or np.linalg.cond(matrix / size) > _LARGEST_CONDITION:
            raise UserError(
                source,
                "frame.sensor_positions_m",
                f"the sensors of floor {floor} do not determine its two translations and its rotation",
                "use three sensors on each floor, two of them parallel and apart",
            )
        inverse = np.linalg.pinv(matrix)
        part = slice(3 * index, 3 * index + 3)
        shapes[part] = inverse @ values[rows]
        errors[part] = np.sqrt(inverse**2 @ spread[rows] ** 2)
        rest += np.sum((values[rows] - matrix @ shapes[part]) ** 2, axis=0)
    misfit = np.sqrt(rest / np.maximum(np.sum(values**2, axis=0), 1e-300))
    names = tuple(f"floor {floor} {axis}" for floor in floors for axis in AXES)
    return RigidShapes(shapes, errors, names, np.asarray(misfit))


def assemble_rigid(
    fit: MultiModeFit, rigid: RigidShapes, zeta: FloatArray, masses: FloatArray, inertias: FloatArray, axis: str
) -> Assembly:
    """Return M, C and K of rigid floors, or the modes alone where masses, inertias or modes are missing.

    Parameters
    ----------
    fit, rigid
        Modes and their shapes.
    zeta
        Damping ratios, shape (r,).
    masses, inertias
        Shape (n,) [kg], [kg m^2]; the positions of the sensors refer to the centre of mass.
    axis
        Direction of the ground motion for the influence vector of the frame.
    """
    findings = [
        f"mode {mode + 1}: {in_percent(share)} of the shape does not fit rigid floors (check positions and signs)"
        for mode, share in enumerate(rigid.misfit)
        if share > _LARGEST_MISFIT
    ]
    count, modes = rigid.shapes.shape
    numbers = tuple(range(1, modes + 1))
    intervals = np.column_stack([masses, masses])
    known = masses.size * 3 == count and inertias.size * 3 == count and bool(np.isfinite(masses).all())
    if not known or modes != count:
        found = f"{modes} of {count} modes were found"
        if modes > count:
            found = f"{modes} modes were found, and {count // 3} rigid floors have {count}"
        reason = found if known else "masses or moments of inertia are missing"
        findings.append(f"only modes are determined, because {reason}: matrices are left out")
        shapes = normalise_to_largest(rigid.shapes)
        return Assembly(None, shapes, numbers, None, masses, intervals, tuple(findings))
    mass = np.diag(np.column_stack([masses, masses, inertias]).ravel())
    relative = np.linalg.norm(rigid.errors, axis=0) / np.linalg.norm(rigid.shapes, axis=0)
    shapes = orthogonal_shapes(rigid.shapes, mass, relative)
    unit = shapes / np.sqrt(np.sum(shapes * (mass @ shapes), axis=0))
    weighted = mass @ unit
    stiffness = (weighted * fit.angular_frequencies**2) @ weighted.T
    damping = modal_damping_matrix(mass, stiffness, zeta)
    influence = ground_influence(masses.size, axis)
    frame = Frame(mass, damping, stiffness, "identified, rigid floors", influence, rigid.names)
    return Assembly(frame, normalise_to_largest(shapes), numbers, None, masses, intervals, tuple(findings))
