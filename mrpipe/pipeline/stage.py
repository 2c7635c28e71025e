"""Definition of a stage: declared inputs, outputs and settings, and a function that does the work.

The function gets everything from its :class:`StageContext`, which refuses settings and inputs that were not
declared; so a stage's cache key depends on everything that it reads.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # the command line reads every stage for its help text, so nothing heavy is imported here
    import numpy as np

    from mrpipe.artifacts import Artifact, ArtifactWriter, Progress, Provenance
    from mrpipe.reporting.sink import Sink


@dataclass(frozen=True)
class StageContext:
    """All that the function of a stage may use.

    Attributes
    ----------
    stage
        Name of the stage.
    settings
        Attribute access to the declared sections: `context.settings.prepare.cutoff_hz`. Others raise LookupError.
    inputs
        Declared input -> path. Stage inputs are artifacts (`prepare` -> …/prepared.h5), campaign inputs are directories
        (`campaign:bench`). Optional inputs that do not exist are missing from the mapping.
    run_directory
        The run directory; outputs are named relative to it.
    rng
        Generator seeded from the run's seed and the stage's name.
    seed
        Seed of the run.
    jobs
        Number of processes that may be used; it does not change results.
    progress
        Called with the share of the work that is done, and a text.
    report
        The stage's part of the report.
    log
        Log lines of the run.
    provenance
        Written into every artifact.
    warnings
        Warnings of the stage so far.
    failures
        Failures of parts of the stage so far.
    """

    stage: str
    settings: Any
    inputs: Mapping[str, Path]
    run_directory: Path
    rng: np.random.Generator
    seed: int
    jobs: int
    progress: Progress
    report: Sink
    log: logging.Logger
    provenance: Provenance
    warnings: list[str] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def artifact(self, name: str) -> Artifact:
        """Open a declared input artifact."""
        from mrpipe.artifacts import Artifact

        return Artifact(self.inputs[name])

    @contextmanager
    def write(self, file: str) -> Iterator[ArtifactWriter]:
        """Write an output artifact of this name in the run directory, atomically and with its provenance."""
        from mrpipe.artifacts import ArtifactWriter

        with ArtifactWriter.create(self.run_directory / file, self.provenance) as artifact:
            yield artifact

    def warn(self, message: str) -> None:
        """Warn the user without stopping the stage; the warning is kept with the result and shown in the report."""
        self.warnings.append(message)
        self.log.warning("%s: %s", self.stage, message)

    def fail(self, part: str, error: Exception) -> None:
        """Record that a part of the stage failed while its other results stand; the exit status is 1 then."""
        message = f"{part} failed: {' '.join(str(error).split())}"
        self.failures.append(message)
        self.warn(message)


@dataclass(frozen=True)
class Stage:
    """A step of the pipeline.

    Attributes
    ----------
    name
        As on the command line (`train-forward`).
    summary
        One line for help texts and the report.
    run
        Does the work and returns the summary that `--json` prints: values of JSON in SI units, keys with the unit as
        suffix. It raises :class:`~mrpipe.errors.StageSkipped` if it has no data.
    inputs
        Names of stages whose artifact is read, or `campaign:bench`, `campaign:frame`, `campaign:closed-loop`.
    preferred_inputs
        The same. They are built like inputs; if one is skipped or fails, the stage runs without it.
    optional_inputs
        The same. They are built if that is possible, and used if they exist.
    known_inputs
        The same, used only if they are up to date: they are not built for this stage.
    conditional_inputs
        (dotted setting, value, input): a further input where the setting has this value. The order of the stages
        does not follow from them.
    settings
        Dotted names of the settings read: whole sections (`prepare`) or single ones (`simulate.excitation`).
    outputs
        Files (or directories) written, relative to the run directory; the first is the stage's artifact.
    after
        Stages (or families of stages) that `mrpipe run` and `status` list before this one, in addition to those whose
        results it reads.
    family
        Command that this stage is one choice of (`simulate` for `simulate-vd`). Empty: the stage is a command itself.
    public_data
        Folders of the public measurements ($MRPIPE_DATA) that the stage reads; they count by content.
    check
        Checks the declared settings before anything is built for the stage; raises UserError if they are wrong.
    """

    name: str
    summary: str
    run: Callable[[StageContext], Mapping[str, Any]]
    inputs: tuple[str, ...] = ()
    preferred_inputs: tuple[str, ...] = ()
    optional_inputs: tuple[str, ...] = ()
    known_inputs: tuple[str, ...] = ()
    conditional_inputs: tuple[tuple[str, str | None, str], ...] = ()
    settings: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    family: str = ""
    public_data: tuple[str, ...] = ()
    check: Callable[[Any], None] | None = None

    @property
    def all_inputs(self) -> tuple[str, ...]:
        """All that the stage may read; required inputs come first."""
        return (*self.inputs, *self.preferred_inputs, *self.optional_inputs, *self.known_inputs)

    def for_configuration(self, configuration: Any) -> Stage:
        """Return the stage with the inputs that its settings require in this configuration."""
        more = [name for name in self.required_by(configuration) if name not in self.inputs]
        return replace(self, inputs=(*self.inputs, *more)) if more else self

    def required_by(self, configuration: Any) -> dict[str, list[str]]:
        """Return the conditional inputs that this configuration requires, each with the settings that require it."""
        required: dict[str, list[str]] = {}
        for setting, value, name in self.conditional_inputs:
            found = configuration
            for part in setting.split("."):
                found = getattr(found, part)
            if found == value:
                required.setdefault(name, []).append(f"{setting}: {'null' if value is None else value}")
        return required
