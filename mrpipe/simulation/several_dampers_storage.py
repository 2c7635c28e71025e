"""Response of a structure with several dampers: indices, and histories in an artifact."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrpipe.artifacts import ArtifactWriter
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.indices import indices, places_table
from mrpipe.simulation.several_dampers import DampersResponse
from mrpipe.simulation.several_dampers_rig import DampersRig

_FLOORS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "absolute_acceleration": "m/s^2"}
_RUN = {"time_s": "s", "ground_acceleration": "m/s^2", "work_in": "J", "work_frame": "J", "energy": "J"}
_DAMPER = {
    "damper_displacement": "m",
    "damper_velocity": "m/s",
    "force": "N",
    "desired_force": "N",
    "work_damper": "J",
}
_OF_A_DAMPER = (
    "rms_damper_displacement_m",
    "rms_force_n",
    "force_tracking_nrmse",
    "residual_force_n",
    "energy_damper_j",
    "clipped_share",
    "faulty_share",
    "switched_off_share",
    "saturated_share",
    "rms_drive",
    "mean_drive",
)
"""Indices that belong to one damper; those of floors, decay and energy belong to the run."""


def response_summary(rig: DampersRig, response: DampersResponse, excitation: Excitation) -> dict[str, Any]:
    """Return what `mrpipe simulate --json` prints: indices of the run, and of each damper under `dampers`.

    Parameters
    ----------
    rig, response, excitation
        Rig, response and excitation of the run.
    """
    rows: list[dict[str, Any]] = []
    run: dict[str, Any] = {}
    for item, (name, own) in zip(rig.dampers, response.dampers.items(), strict=True):
        values = indices(
            own,
            excitation,
            residual_force_n=item.known.calibrated.residual_force_n,
            drive_limit=item.controller.drive_limit or item.model.drive_limit,
        )
        run = run or {
            key: value
            for key, value in values.items()
            if key not in _OF_A_DAMPER and not key.startswith(("force_tracking", "energy_"))
        }
        rows.append(
            {
                "name": name,
                "law": item.known.law,
                **{key: values[key] for key in _OF_A_DAMPER if key in values},
                "peak_damper_displacement_m": float(np.max(np.abs(own.damper_displacement))),
                "peak_force_n": float(np.max(np.abs(own.force))),
                "drive_unit": item.model.drive_unit,
            }
        )
    return {
        **run,
        "dampers": rows,
        "degrees_of_freedom": places_table(response.first, rig.frame.names, excitation),
        "energy_balance_error": response.energy_balance_error,
        "excitation": excitation.details,
    }


def write_dampers_response(artifact: ArtifactWriter, rig: DampersRig, response: DampersResponse) -> None:
    """Write the histories of the floors, and a group `dampers/<number>` for each damper."""
    first = response.first
    for name, unit in _RUN.items():
        artifact.put(name.removesuffix("_s"), getattr(first, name), unit=unit, dims=("time",))
    for name, unit in _FLOORS.items():
        artifact.put(name, getattr(first, name), unit=unit, dims=("time", "floor"))
    for place, (item, (name, own)) in enumerate(zip(rig.dampers, response.dampers.items(), strict=True), start=1):
        group = f"dampers/{place}"
        for key, unit in _DAMPER.items():
            artifact.put(f"{group}/{key}", getattr(own, key), unit=unit, dims=("time",))
        artifact.put(f"{group}/drive", own.drive, unit=item.model.drive_unit, dims=("time",))
        artifact.attributes(group, name=name, law=item.known.law)
