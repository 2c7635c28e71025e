"""From modes to M, C and K: from all modes if they are complete, else by updating a storey model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.doubts import Doubt
from mrpipe.modal.matrices.completion import completed_shapes
from mrpipe.modal.matrices.tridiagonal import TridiagonalFit, fit_partial, storeys_of
from mrpipe.modal.matrices.updating import MeasuredModes, UpdatedModel
from mrpipe.modal.search.selection import Layout
from mrpipe.structures import Frame, frame_from_modes, modal_damping_matrix, natural_modes, normalise_to_largest
from mrpipe.words import in_percent, noun

_MODEL_ERROR = 0.02
"""Relative frequency error of the storey model above which the user is warned."""
_OPEN_TURN = 0.1
"""Standard error [rad] of the rotation of rows without a sensor above which their shapes are not determined."""


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
        Source of the scale, for messages.
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
        Shape (n, r), expanded to floors without a sensor; NaN at floors at which they are not determined.
    numbers
        Mode number (from 1) of each column.
    storeys
        Storey model; None if the masses are unknown.
    masses
        Shape (n,) [kg]; nan where unknown.
    mass_intervals
        Shape (n, 2) [kg].
    findings
        Quantities that are not determined, one line each.
    exchanged
        Whether sensors are probably at other floors than declared.
    """

    frame: Frame | None
    shapes: FloatArray
    numbers: tuple[int, ...]
    storeys: TridiagonalFit | None
    masses: FloatArray
    mass_intervals: FloatArray
    findings: tuple[str, ...]
    exchanged: bool = False


def can_scale(masses: FloatArray, modes: PartialModes) -> bool:
    """Return whether a known mass or a measured force determines the scale of the mass matrix."""
    scaled = modes.driven >= 0 and modes.scaled_residues is not None and bool(np.isfinite(modes.scaled_residues).any())
    return bool(np.isfinite(masses).any()) or scaled


def assemble_partial(modes: PartialModes, masses: FloatArray, layout: Layout, source: Path) -> Assembly:
    """Build a frame from modes that are incomplete, have floors without a sensor, or whose masses are unknown.

    A storey model with the known masses is fitted to the modes. It gives the mode numbers and the shapes at floors
    without a sensor. If all modes were found, the matrices follow from the expanded shapes after orthogonalisation with
    respect to the mass; else they are those of the storey model, with the mean damping ratio for modes that were not
    found. Shapes that are orthogonal to known masses do not depend on the storey model, so that a storey which is not
    determined does not affect them.
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
    orthogonal = len(updated.numbers) == layout.floors and bool(np.isfinite(masses).all())
    open_rows = [row for row in unknown_rows if not orthogonal and _is_open(updated, row)]
    mass = np.diag(updated.masses)
    model = natural_modes(Frame(mass, np.zeros_like(mass), updated.stiffness)).mode_shapes
    index = np.asarray(updated.numbers) - 1
    shapes = _expanded(modes, model, index)
    zeta = np.full(layout.floors, float(np.mean(modes.damping_ratios)))
    zeta[index] = modes.damping_ratios
    storeys = storeys_of(updated)
    if len(index) == layout.floors:
        completed = completed_shapes(shapes, modes.errors, modes.measured, updated.masses, modes.angular_frequencies)
        whole = completed.shapes
        frame = frame_from_modes(
            whole, modes.angular_frequencies, zeta, updated.masses, name="identified", source=source
        )
        # orthogonality to estimated masses would change measured shapes, which are more accurate
        shapes = whole if orthogonal else shapes
        open_rows = unknown_rows if orthogonal and completed.turn_error > _OPEN_TURN else open_rows
    else:
        damping = modal_damping_matrix(mass, updated.stiffness, zeta)
        frame = Frame(mass, damping, updated.stiffness, "identified, storey model")
    shapes = normalise_to_largest(shapes)
    shapes[open_rows] = np.nan
    findings = _findings(updated, modes, layout, unknown_rows, open_rows, orthogonal)
    return Assembly(
        frame=frame,
        shapes=shapes,
        numbers=updated.numbers,
        storeys=storeys,
        masses=updated.masses,
        mass_intervals=np.column_stack([updated.mass_low, updated.mass_high]),
        findings=tuple(findings),
    )


def _modes_only(modes: PartialModes, masses: FloatArray, layout: Layout, unknown_rows: list[int]) -> Assembly:
    shapes = normalise_to_largest(modes.shapes)
    shapes[unknown_rows] = np.nan
    if layout.is_chain:
        reason, remedy = "no mass is known and no force", "give frame.floor_masses_kg, or measure the force of a shaker"
    else:
        reason = "the sensors measure in several directions or at several places of a floor"
        remedy = "give frame.sensor_positions_m and the masses, if the sensors of each floor determine how it moves"
    findings = [
        f"only modes are determined, because {reason}: mass, damping and stiffness matrices are left out ({remedy})"
    ]
    if unknown_rows:
        floors = ", ".join(str(row + 1) for row in unknown_rows)
        findings.append(f"floors without a sensor ({floors}): their mode shapes are not determined")
    numbers = tuple(range(1, modes.angular_frequencies.size + 1))
    return Assembly(None, shapes, numbers, None, masses, np.column_stack([masses, masses]), tuple(findings))


def _is_open(updated: UpdatedModel, row: int) -> bool:
    """Return whether the mass of a floor (from 0), or the storey below or above it, is not determined.

    The shape at a floor without a sensor depends on these quantities alone, so that it would be unreliable.
    """
    return not {f"mass {row + 1}", f"storey {row + 1}", f"storey {row + 2}"}.isdisjoint(updated.undetermined)


def _findings(
    updated: UpdatedModel,
    modes: PartialModes,
    layout: Layout,
    unknown_rows: list[int],
    open_rows: list[int],
    orthogonal: bool,
) -> list[str]:
    findings: list[str] = []
    missing = sorted(set(range(1, layout.floors + 1)) - set(updated.numbers))
    if missing:
        names = ", ".join(str(number) for number in missing)
        findings.append(
            Doubt(
                f"{len(updated.numbers)} of {layout.floors} modes were found; {noun(len(missing), 'mode')} {names} "
                f"{'is' if len(missing) == 1 else 'are'} not determined by the data: K is that of a storey model, and "
                f"{'its' if len(missing) == 1 else 'their'} damping is the mean of the others"
            )
        )
    expanded = [row for row in unknown_rows if row not in open_rows]
    if open_rows:
        floors = ", ".join(str(row + 1) for row in open_rows)
        findings.append(
            f"floors without a sensor ({floors}): their mode shapes are not determined, because the data do not "
            "determine "
            + (
                "how their motion is divided among them"
                if orthogonal
                else "the mass of the floor or the stiffness of a storey next to it"
            )
        )
    if expanded:
        floors = ", ".join(str(row + 1) for row in expanded)
        findings.append(
            f"floors without a sensor ({floors}): their mode shapes are "
            + ("expanded by orthogonality to the mass" if orthogonal else "those of the storey model")
        )
    if updated.undetermined:
        names = ", ".join(updated.undetermined)
        findings.append(Doubt(f"the data do not determine {names} (interval wider than half)"))
    instead = "K follows from the modes instead" if not missing else "K is therefore uncertain"
    findings += storey_model_findings(storeys_of(updated), updated.numbers, instead)
    if modes.driven >= 0 and np.any(updated.mass_high > updated.mass_low):
        findings.append(f"unknown masses were scaled by {modes.scaled_by}")
    return findings


def storey_model_findings(storeys: TridiagonalFit, numbers: Sequence[int], instead: str) -> list[str]:
    """Return a line if springs between neighbouring floors do not give the measured frequencies; else nothing.

    Parameters
    ----------
    storeys
        The storey model.
    numbers
        Mode number (from 1) of each mode.
    instead
        Source of K, the end of the line.
    """
    error = np.abs(storeys.frequency_error)
    if error.max() <= _MODEL_ERROR:
        return []
    mode = numbers[int(np.argmax(error))]
    return [
        f"with springs between neighbouring floors alone the frequency of mode {mode} differs by "
        f"{in_percent(error.max(), 1)}; {instead}"
    ]


def _expanded(modes: PartialModes, model: FloatArray, index: FloatArray) -> FloatArray:
    """Return shapes at all floors: measured ones, or the mode of the model scaled to the measured floors."""
    shapes = modes.shapes.copy()
    rows = list(modes.measured)
    unknown = [row for row in range(shapes.shape[0]) if row not in modes.measured]
    for column, mode in enumerate(np.asarray(index, dtype=np.int64)):
        own = model[rows, mode]
        scale = float(own @ modes.shapes[rows, column] / (own @ own))
        shapes[unknown, column] = scale * model[unknown, mode]
    return shapes
