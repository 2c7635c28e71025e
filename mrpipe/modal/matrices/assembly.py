"""From modes to M, C and K: by all modes where they are complete, else by updating a storey model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import expm
from scipy.optimize import lsq_linear, minimize

from mrpipe.artifacts import FloatArray
from mrpipe.modal.matrices.tridiagonal import TridiagonalFit, fit_partial, storeys_of
from mrpipe.modal.matrices.updating import MeasuredModes, UpdatedModel
from mrpipe.modal.search.selection import Layout
from mrpipe.structures import Frame, frame_from_modes, modal_damping_matrix, natural_modes, normalise_to_largest

_MODEL_ERROR = 0.02
"""Relative frequency error of the storey model above which the user is warned."""


@dataclass(frozen=True)
class PartialModes:
    """Modes that do not determine the frame by themselves.

    Attributes
    ----------
    angular_frequencies, damping_ratios
        Shape (r,) [rad/s], [1].
    shapes, errors
        Shape (n, r): real, zero and infinite error at floors without a sensor.
    measured
        Floors (from 0) with a sensor.
    possible_numbers
        Lowest and highest mode number (from 1) that each shape allows.
    scaled_residues
        Shape (r,) [1/kg]: acceleration over force at the floor `driven`, nan where unknown.
    driven
        Floor (from 0) where a measured force acts or whose motion is scaled by an added mass; -1 if there is none.
    scale_errors
        Shape (r,): relative standard errors of `scaled_residues`; None: the usual error.
    scaled_by
        What gives the scale, for messages.
    """

    angular_frequencies: FloatArray
    damping_ratios: FloatArray
    shapes: FloatArray
    errors: FloatArray
    measured: tuple[int, ...]
    possible_numbers: tuple[tuple[int, int], ...]
    scaled_residues: FloatArray | None = None
    driven: int = -1
    scale_errors: FloatArray | None = None
    scaled_by: str = "the measured force"


@dataclass(frozen=True)
class Assembly:
    """The part of the structure that the modes determine.

    Attributes
    ----------
    frame
        None where masses and scale are unknown.
    shapes
        Shape (n, r), expanded to floors without a sensor; nan there where nothing determines them.
    numbers
        Mode number (from 1) of each column.
    storeys
        Storey model; None where the masses are unknown.
    masses
        Shape (n,) [kg]; nan where unknown.
    mass_intervals
        Shape (n, 2) [kg].
    findings
        What is not determined, one line each.
    """

    frame: Frame | None
    shapes: FloatArray
    numbers: tuple[int, ...]
    storeys: TridiagonalFit | None
    masses: FloatArray
    mass_intervals: FloatArray
    findings: tuple[str, ...]


def can_scale(masses: FloatArray, modes: PartialModes) -> bool:
    """Return whether a known mass or a measured force sets the scale of the mass matrix."""
    scaled = modes.driven >= 0 and modes.scaled_residues is not None and bool(np.isfinite(modes.scaled_residues).any())
    return bool(np.isfinite(masses).any()) or scaled


def assemble_partial(modes: PartialModes, masses: FloatArray, layout: Layout, source: Path) -> Assembly:
    """Build a frame from modes that are incomplete, have floors without a sensor, or whose masses are unknown.

    A storey model with the known masses is fitted to the modes. It gives the mode numbers and the shapes at floors
    without a sensor. Where all modes were found, the matrices follow from the expanded shapes made orthogonal to the
    mass; else they are those of the storey model, with the mean damping ratio for modes that were not found.
    """
    unknown_rows = [row for row in range(layout.floors) if row not in modes.measured]
    if not layout.is_chain or not can_scale(masses, modes):
        return _modes_only(modes, masses, layout, unknown_rows)
    data = MeasuredModes(
        modes.angular_frequencies,
        modes.shapes[list(modes.measured)],
        modes.measured,
        scaled_residues=modes.scaled_residues if not np.isfinite(masses).all() else None,
        driven=modes.driven,
        scale_error=0.05 if modes.scale_errors is None else np.maximum(0.5 * modes.scale_errors, 0.005),
    )
    updated = fit_partial(masses, data, modes.possible_numbers)
    findings = _findings(updated, modes, layout, unknown_rows)
    mass = np.diag(updated.masses)
    model = natural_modes(Frame(mass, np.zeros_like(mass), updated.stiffness)).mode_shapes
    index = np.asarray(updated.numbers) - 1
    shapes = _expanded(modes, model, index)
    zeta = np.full(layout.floors, float(np.mean(modes.damping_ratios)))
    zeta[index] = modes.damping_ratios
    storeys = storeys_of(updated)
    if len(index) == layout.floors:
        shapes = _completed(shapes, modes, updated.masses)
        frame = frame_from_modes(
            shapes, modes.angular_frequencies, zeta, updated.masses, name="identified", source=source
        )
    else:
        damping = modal_damping_matrix(mass, updated.stiffness, zeta)
        frame = Frame(mass, damping, updated.stiffness, "identified, storey model")
    return Assembly(
        frame=frame,
        shapes=normalise_to_largest(shapes),
        numbers=updated.numbers,
        storeys=storeys,
        masses=updated.masses,
        mass_intervals=np.column_stack([updated.mass_low, updated.mass_high]),
        findings=tuple(findings),
    )


def _modes_only(modes: PartialModes, masses: FloatArray, layout: Layout, unknown_rows: list[int]) -> Assembly:
    shapes = normalise_to_largest(modes.shapes)
    shapes[unknown_rows] = np.nan
    reason = "the sensors measure in several directions" if not layout.is_chain else "no mass is known and no force"
    findings = [
        f"only modes are determined, because {reason}: mass, damping and stiffness matrices are left out"
        + (" (give frame.floor_masses_kg, or measure the force of a shaker)" if layout.is_chain else "")
    ]
    if unknown_rows:
        floors = ", ".join(str(row + 1) for row in unknown_rows)
        findings.append(f"floors without a sensor ({floors}): their mode shapes are not determined")
    numbers = tuple(range(1, modes.angular_frequencies.size + 1))
    return Assembly(None, shapes, numbers, None, masses, np.column_stack([masses, masses]), tuple(findings))


def _findings(updated: UpdatedModel, modes: PartialModes, layout: Layout, unknown_rows: list[int]) -> list[str]:
    findings = []
    missing = sorted(set(range(1, layout.floors + 1)) - set(updated.numbers))
    if missing:
        names = ", ".join(str(number) for number in missing)
        findings.append(
            f"{len(updated.numbers)} of {layout.floors} modes were found; modes {names} are not determined by the "
            "data: K is that of a storey model, and their damping is the mean of the others"
        )
    if unknown_rows:
        floors = ", ".join(str(row + 1) for row in unknown_rows)
        findings.append(
            f"floors without a sensor ({floors}): their mode shapes are "
            + ("expanded by orthogonality to the mass" if not missing else "those of the storey model")
        )
    if updated.undetermined:
        findings.append(f"the data do not determine {', '.join(updated.undetermined)} (interval wider than half)")
    worst = float(np.abs(updated.frequency_error).max())
    if worst > _MODEL_ERROR:
        mode = updated.numbers[int(np.argmax(np.abs(updated.frequency_error)))]
        findings.append(f"the storey model misses the frequency of mode {mode} by {100.0 * worst:.1f} %")
    if modes.driven >= 0 and np.any(updated.mass_high > updated.mass_low):
        findings.append(f"unknown masses were scaled by {modes.scaled_by}")
    return findings


def _expanded(modes: PartialModes, model: FloatArray, index: FloatArray) -> FloatArray:
    """Return shapes at all floors: measured where a sensor is, else the model's mode scaled to the measured floors."""
    shapes = modes.shapes.copy()
    rows = list(modes.measured)
    unknown = [row for row in range(shapes.shape[0]) if row not in modes.measured]
    for column, mode in enumerate(np.asarray(index, dtype=np.int64)):
        own = model[rows, mode]
        scale = float(own @ modes.shapes[rows, column] / (own @ own))
        shapes[unknown, column] = scale * model[unknown, mode]
    return shapes


def _completed(shapes: FloatArray, modes: PartialModes, masses: FloatArray) -> FloatArray:
    """Return the shapes orthogonal to the mass; the rows of floors with a sensor decide.

    With L = M^(1/2) the mass-normalised shapes form an orthogonal matrix. Its measured rows A are known up to a scale
    d_r of each mode, and A diag(d^2) A' = 1 gives these scales. The other rows span the complement of the measured
    ones. Of all rotations of the complement the one is taken that leaves the smallest stiffness between floors that
    are not neighbours, because the measurements cannot show it.
    """
    root = np.sqrt(masses)[:, None]
    rows = list(modes.measured)
    unknown = [row for row in range(shapes.shape[0]) if row not in modes.measured]
    scaled = root * shapes
    scaled = scaled / np.linalg.norm(scaled, axis=0)
    if not unknown:
        whole = _nearest_orthonormal(scaled)
    else:
        whole = np.empty_like(scaled)
        whole[rows] = _nearest_orthonormal(scaled[rows] * _mode_scales(scaled[rows]))
        rest = scaled[unknown] - scaled[unknown] @ whole[rows].T @ whole[rows]
        whole[unknown] = _rotated(whole, unknown, _nearest_orthonormal(rest), modes.angular_frequencies, masses)
    return np.asarray(whole / root)


def _mode_scales(rows: FloatArray) -> FloatArray:
    """Return d (n,) of A diag(d^2) A' = 1 by least squares, or ones if there is no positive solution."""
    size = rows.shape[0]
    upper = [(i, j) for i in range(size) for j in range(i, size)]
    if len(upper) < rows.shape[1]:
        return np.ones(rows.shape[1])
    matrix = np.array([rows[i] * rows[j] for i, j in upper])
    squared = lsq_linear(matrix, [float(i == j) for i, j in upper], bounds=(1e-6, np.inf)).x
    return np.asarray(np.sqrt(squared))


def _rotated(
    whole: FloatArray, unknown: list[int], start: FloatArray, angular_frequencies: FloatArray, masses: FloatArray
) -> FloatArray:
    """Return the rows of floors without a sensor, rotated and reflected for the least stiffness beyond neighbours."""
    count, floors = len(unknown), whole.shape[0]
    beyond = np.abs(np.subtract.outer(np.arange(floors), np.arange(floors))) > 1
    root = np.sqrt(masses)
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]

    def rows_of(angles: FloatArray, signs: FloatArray) -> FloatArray:
        turn = np.zeros((count, count))
        for (i, j), angle in zip(pairs, angles, strict=True):
            turn[i, j], turn[j, i] = angle, -angle
        return np.asarray(signs[:, None] * (expm(turn) @ start))

    def cost(angles: FloatArray, signs: FloatArray) -> float:
        trial = whole.copy()
        trial[unknown] = rows_of(angles, signs)
        stiffness = root[:, None] * (trial * angular_frequencies**2) @ trial.T * root
        scale = np.sqrt(np.diag(stiffness))
        relative = stiffness / np.outer(scale, scale)
        # a positive element between neighbours would be a negative storey stiffness
        wrong = np.maximum(np.diag(relative, 1), 0.0)
        return float(np.sum(relative[beyond] ** 2) + 2.0 * np.sum(wrong**2))

    best = (np.inf, start)
    for choice in range(2**count):
        signs = np.array([1.0 if choice >> bit & 1 else -1.0 for bit in range(count)])
        for angle in np.linspace(0.0, np.pi, 7)[:-1] if pairs else (0.0,):
            first = np.full(len(pairs), angle)
            angles = minimize(cost, first, args=(signs,)).x if pairs else first
            best = min(best, (cost(angles, signs), rows_of(angles, signs)), key=lambda item: item[0])
    return best[1]


def _nearest_orthonormal(rows: FloatArray) -> FloatArray:
    left, _, right = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(left @ right)
