"""Matrices of a given structure from data files, and contents of frame.h5 for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import ArtifactWriter
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.files import open_data_file
from mrpipe.errors import UserError
from mrpipe.structures.dynamics import modal_assurance, natural_modes, normalise_to_largest
from mrpipe.structures.frame import Frame, write_frame
from mrpipe.structures.given_checks import require_dissipation
from mrpipe.structures.opensees import opensees_matrices
from mrpipe.structures.reduction import Reduced


def read_matrix(file: Path, name: str) -> Any:
    """Return a variable of a data file; without a name, the only variable or all columns of a table.

    Raises
    ------
    UserError
        If the file cannot be read, or it holds no such variable.
    """
    if not file.is_file():
        raise UserError(file, "", "file of the structure not found", "correct `file` in the section `structure`")
    if file.suffix == ".py":
        matrices = opensees_matrices(file)
        if name not in matrices:
            raise UserError(file, name, "is not a matrix of an OpenSees model", "M, C or K")
        return matrices[name]
    found = open_data_file(file)
    if name:
        key = found.aliases.get(name, name)
        if key not in found.names:
            known = ", ".join(found.names[:12]) or "nothing"
            bare = found.table and all(column.isdigit() for column in found.names)
            whole = "; for the whole table write name: ''" if bare else ""
            raise UserError(file, name, "is not in the file", f"it holds {known}{whole}")
        content = _fetched(found, key)
    elif found.table:
        content = np.column_stack([np.asarray(found.fetch(column), dtype=np.float64) for column in found.names])
    elif len(found.names) == 1:
        content = _fetched(found, found.names[0])
    else:
        raise UserError(file, "", f"holds {len(found.names)} variables", "name one of them in the setting")
    if isinstance(content, UserError):
        raise content
    return content


def _fetched(found: DataFile, name: str) -> Any:
    try:
        return found.fetch(name)
    except ValueError as error:
        said = " ".join(str(error).split())[:200]
        raise UserError(found.path, name, f"cannot be read ({said})", "give a matrix of numbers") from error


def given_summary(full: Frame, reduced: Reduced, heights_m: list[float] | None = None) -> dict[str, Any]:
    """Return the summary of a given structure for `mrpipe identify-frame --json`, as plain numbers in SI.

    Intervals have zero width, because a given structure has no measurement error. `mac` compares each mode of the
    reduced structure with the same mode of the full one. `heights_m` is the height of each degree of freedom.

    Raises
    ------
    UserError
        If the damping matrix feeds energy into a mode.
    """
    frame = reduced.frame
    modes = natural_modes(frame)
    omega, shapes = modes.angular_frequencies, modes.mode_shapes
    damping_ratios = np.diag(shapes.T @ frame.damping @ shapes) / (2.0 * omega)
    require_dissipation(damping_ratios)
    frequencies = modes.frequencies_hz
    mac = modal_assurance(reduced.basis @ shapes, natural_modes(full).mode_shapes[:, : omega.size])
    return {
        "campaign": "",
        "structure": full.name,
        "frequencies_hz": frequencies.tolist(),
        "damping_ratios": damping_ratios.tolist(),
        "mode_shapes": normalise_to_largest(shapes).tolist(),
        "mass": frame.mass.tolist(),
        "damping": frame.damping.tolist(),
        "stiffness": frame.stiffness.tolist(),
        "mac": np.diag(mac).tolist(),
        "mac_matrix": mac.tolist(),
        "mode_numbers": list(range(1, omega.size + 1)),
        "degrees_of_freedom": list(frame.names),
        # after a reduction the coordinates are no longer the floors
        "heights_m": heights_m if frame is full else None,
        "influence": frame.ground_influence.tolist(),
        "influence_y": None if frame.influence_y is None else frame.influence_y.tolist(),
        "frequency_intervals_hz": [[value, value] for value in frequencies.tolist()],
        "damping_ratio_intervals": [[value, value] for value in damping_ratios.tolist()],
        "damping_source": ["given"] * omega.size,
        "full_degrees_of_freedom": full.floors,
        "reduction_error": reduced.error,
        "reduction_band_high_hz": reduced.band_high_hz,
    }


def write_given(artifact: ArtifactWriter, reduced: Reduced, summary: dict[str, Any]) -> None:
    """Write matrices and modes to the same groups as for an identified frame."""
    write_frame(artifact, reduced.frame)
    artifact.put("modes/shapes", summary["mode_shapes"], unit="1", dims=("floor", "mode"))
    artifact.put("modes/mac", summary["mac_matrix"], unit="1", dims=("reduced_mode", "full_mode"))
    artifact.put("modes/number", [float(number) for number in summary["mode_numbers"]], unit="1", dims=("mode",))
    omega = 2.0 * np.pi * np.asarray(summary["frequencies_hz"])
    artifact.put("modes/angular_frequency", omega, unit="rad/s", dims=("mode",))
    artifact.put("modes/damping_ratio", summary["damping_ratios"], unit="1", dims=("mode",))
    artifact.put("reduction/basis", reduced.basis, unit="1", dims=("full_degree_of_freedom", "floor"))
    artifact.put("reduction/error", reduced.error, unit="1")
    artifact.put_json("summary", summary)
