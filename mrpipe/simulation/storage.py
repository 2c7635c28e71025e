"""A response in an artifact."""

from __future__ import annotations

from collections.abc import Sequence

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray
from mrpipe.simulation.loop import Response
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.windows import DISPLAYED, QUANTITIES

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


COMMANDS = (
    ("drive", ""),
    ("desired_force", "N"),
    ("desired_force_before_clipping", "N"),
    ("estimated_displacement", "m"),
    ("estimated_velocity", "m/s"),
    ("amplitude", "m"),
    ("is_clipped", "1"),
    ("is_switched_off", "1"),
    ("drive_of_inverse", ""),
    ("fault", "1"),
)
"""Name and unit of the controller's signals in the order of :mod:`mrpipe.control.kernel`.

An empty unit stands for that of the drive.
"""


def write_response(artifact: ArtifactWriter, response: Response, drive_unit: str) -> None:
    """Write the histories of a response."""
    for name, unit in _HISTORIES.items():
        artifact.put(name.removesuffix("_s"), getattr(response, name), unit=unit, dims=("time",))
    for name, unit in _FLOORS.items():
        artifact.put(name, getattr(response, name), unit=unit, dims=("time", "floor"))
    artifact.put("drive", response.drive, unit=drive_unit, dims=("time",))
    columns = [{"name": name, "unit": unit or drive_unit} for name, unit in COMMANDS]
    artifact.put(
        "commands", response.commands[:, : len(columns)], unit="see command_columns", dims=("sample", "command")
    )
    artifact.put_json("command_columns", columns)
    artifact.put("command_time", response.command_time_s, unit="s", dims=("sample",))


def read_histories(artifact: Artifact) -> dict[str, FloatArray]:
    """Return the histories by name."""
    names = [*(name.removesuffix("_s") for name in _HISTORIES), *_FLOORS, "drive"]
    return {name: artifact.array(name) for name in names}


def write_curves(artifact: ArtifactWriter, curves: Sequence[ResponseCurve], within: str = "") -> None:
    """Write response curves: a group `amplitude_<k>` for each amplitude of the base acceleration.

    Parameters
    ----------
    artifact, curves
        Where, and what.
    within
        Group of these groups, with its slash at the end.
    """
    for number, curve in enumerate(curves, start=1):
        group = f"{within}amplitude_{number}"
        artifact.put(f"{group}/base_amplitude", curve.base_amplitude_m_s2, unit="m/s^2")
        artifact.put(f"{group}/frequency", curve.frequency_rad_s, unit="rad/s", dims=("frequency",))
        artifact.put(f"{group}/resonance", curve.resonance_rad_s, unit="rad/s")
        for name in DISPLAYED:
            unit = "m/s^2" if name.endswith("_m_s2") else "m"
            plain = name.removesuffix("_m_s2").removesuffix("_m")
            artifact.put(f"{group}/{plain}", curve.column(name), unit=unit, dims=("frequency",))
            errors = curve.errors[:, QUANTITIES.index(name)]
            artifact.put(f"{group}/standard_error_{plain}", errors, unit=unit, dims=("frequency",))
