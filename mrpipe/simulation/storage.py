"""A response in an artifact."""

from __future__ import annotations

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray
from mrpipe.simulation.loop import Response

_FLOORS = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "absolute_acceleration": "m/s^2",
}
_HISTORIES = {
    "time_s": "s",
    "damper_displacement": "m",
    "damper_velocity": "m/s",
    "force": "N",
    "desired_force": "N",
    "ground_acceleration": "m/s^2",
    "work_in": "J",
    "work_damper": "J",
    "work_frame": "J",
    "energy": "J",
}


def write_response(artifact: ArtifactWriter, response: Response, drive_unit: str) -> None:
    """Write the histories of a response."""
    for name, unit in _HISTORIES.items():
        artifact.put(name.removesuffix("_s"), getattr(response, name), unit=unit, dims=("time",))
    for name, unit in _FLOORS.items():
        artifact.put(name, getattr(response, name), unit=unit, dims=("time", "floor"))
    artifact.put("drive", response.drive, unit=drive_unit, dims=("time",))
    artifact.put("commands", response.commands, unit="see mrpipe.control.kernel", dims=("sample", "command"))
    artifact.put("command_time", response.command_time_s, unit="s", dims=("sample",))


def read_histories(artifact: Artifact) -> dict[str, FloatArray]:
    """Return the histories by name."""
    names = [*(name.removesuffix("_s") for name in _HISTORIES), *_FLOORS, "drive"]
    return {name: artifact.array(name) for name in names}
