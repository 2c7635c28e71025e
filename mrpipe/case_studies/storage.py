"""Histories of the runs of a benchmark structure in an artifact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from mrpipe.artifacts import ArtifactWriter
from mrpipe.case_studies.model import BenchmarkModel
from mrpipe.case_studies.run import Response


class Case(Protocol):
    """A run of the structure under one law."""

    @property
    def law(self) -> str:
        """Name of the law."""

    @property
    def response(self) -> Response:
        """Histories of the run."""


def write_cases(artifact: ArtifactWriter, model: BenchmarkModel, cases: Sequence[Case]) -> None:
    """Store the histories of each law under `responses/<law>`, and the origin and source of the model."""
    for case in cases:
        write_response(artifact, f"responses/{case.law}", case.response)
    artifact.attributes("/", model=model.origin, source=model.source)


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
