"""Histories of a benchmark run in an artifact."""

from __future__ import annotations

from mrpipe.artifacts import ArtifactWriter
from mrpipe.case_studies.run import Response


def write_response(artifact: ArtifactWriter, group: str, response: Response) -> None:
    """Store the histories of the devices and the energies of a run under `group`."""
    artifact.put(f"{group}/time", response.time_s, unit="s", dims=("time",))
    entries = {
        "stroke": (response.stroke(), "m"),
        "rod_velocity": (response.rod_velocity(), "m/s"),
        "force": (response.forces, "N"),
        "desired_force": (response.desired, "N"),
        "voltage": (response.voltages, "V"),
    }
    for name, (values, unit) in entries.items():
        artifact.put(f"{group}/{name}", values, unit=unit, dims=("time", "device"))
    artifact.put(f"{group}/energies", response.energies, unit="J", dims=("time", "input_damping_devices"))
