"""What a run directory holds for the report: the summaries of its stages and the artifacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from mrpipe.artifacts import Artifact

LAW_STAGE = "simulate-"


@dataclass(frozen=True)
class ReportStage:
    """One stage of the run.

    Attributes
    ----------
    name, about
        Name and summary line of the stage.
    items
        Texts, tables and figures that the stage left for its section.
    summary
        The summary that the stage printed.
    warnings
        Warnings of the stage.
    skipped
        Why it was skipped; empty where it ran.
    seconds
        Wall time.
    failed
        Error of the stage or of a part of it; empty if there was none.
    """

    name: str
    about: str
    items: Sequence[Mapping[str, Any]]
    summary: Mapping[str, Any]
    warnings: Sequence[str]
    skipped: str
    seconds: float
    failed: str = ""


@dataclass(frozen=True)
class RunFacts:
    """A run as the report reads it.

    Attributes
    ----------
    directory
        Run directory.
    title, description
        Title and description in the configuration.
    stages
        Stages that belong to the run, in the order of the pipeline.
    settings
        The configuration as nested mappings; empty where it is not known.
    """

    directory: Path
    title: str
    description: str
    stages: Sequence[ReportStage]
    settings: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def summaries(self) -> dict[str, Mapping[str, Any]]:
        """Stage -> summary of every stage that ran."""
        return {stage.name: stage.summary for stage in self.stages if not stage.skipped and stage.summary}

    def summary(self, stage: str) -> Mapping[str, Any]:
        """Return the summary of a stage; empty where it did not run."""
        return self.summaries.get(stage, {})

    @cached_property
    def laws(self) -> dict[str, Mapping[str, Any]]:
        """Control law -> summary of its simulation, in the order of the pipeline."""
        return {
            name.removeprefix(LAW_STAGE): summary
            for name, summary in self.summaries.items()
            # the run of several dampers has no single law
            if name.startswith(LAW_STAGE) and "rms_x_top_m" in summary and "law" in summary
        }

    def warnings(self, *stages: str) -> list[str]:
        """Return the warnings of some stages; of all where none is named."""
        return [line for stage in self.stages if not stages or stage.name in stages for line in stage.warnings]

    def artifact(self, file: str) -> Artifact | None:
        """Return an artifact of the run, or None where it is not there."""
        path = self.directory / file
        return Artifact(path) if path.is_file() else None

    @cached_property
    def date(self) -> str:
        """Day on which the newest artifact was built, as `2026-11-22`; empty where there is none."""
        dates = []
        for path in self.directory.glob("*.h5"):
            try:
                dates.append(str(Artifact(path).root.get("created_utc", "")))
            except (OSError, KeyError, ValueError, RuntimeError):
                continue
        return max(dates, default="")[:10]

    @cached_property
    def campaigns(self) -> list[str]:
        """Names of the campaigns that the run reads."""
        names = [str(self.summary(stage).get("campaign", "")) for stage in ("prepare", "identify-frame", "close-loop")]
        return [name for name in dict.fromkeys(names) if name]
