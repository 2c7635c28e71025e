"""Execution of one stage: runs its function, and writes its part of the report and its manifest."""

from __future__ import annotations

import hashlib
import logging
import shutil
import time
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from mrpipe.artifacts import Provenance
from mrpipe.artifacts.plain import plain
from mrpipe.config.located import located
from mrpipe.errors import StageSkipped, UserError
from mrpipe.pipeline.files_read import files_read
from mrpipe.pipeline.manifest import Manifest, StageKey
from mrpipe.pipeline.parts import PartWriter
from mrpipe.pipeline.progress import stage_progress
from mrpipe.pipeline.settings_view import SettingsView
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.artifacts import Progress
    from mrpipe.config.loader import LoadedConfig
    from mrpipe.pipeline.fingerprint import FileHashes

MANIFESTS = "manifests"
"""Folder of the manifests in the run directory."""


@dataclass(frozen=True)
class Outcome:
    """Result of one stage: `built`, `reused`, `skipped` or `failed`."""

    stage: str
    what: str
    manifest: Manifest
    reasons: Sequence[str] = ()


@dataclass(frozen=True)
class Order:
    """Order to run a stage.

    Attributes
    ----------
    stage
        Name of the stage.
    key
        Everything on which the result of the stage depends.
    inputs
        Declared input -> path, for the inputs that exist.
    reasons
        Reasons why the stage runs.
    """

    stage: str
    key: StageKey
    inputs: Mapping[str, Path]
    reasons: Sequence[str]


class MakesProgress(Protocol):
    """Returns where a stage reports its progress; :func:`~mrpipe.pipeline.progress.stage_progress` is one."""

    def __call__(self, stage: str, logger: logging.Logger, quiet: bool) -> AbstractContextManager[Progress]:
        """Return the `progress` of a stage."""


@dataclass(frozen=True)
class StageRunner:
    """Runs stages of one configuration in one run directory.

    Attributes
    ----------
    loaded
        The configuration.
    stages
        Name -> stage.
    run_directory
        Directory of artifacts, manifests, figures and tables.
    logger
        Logger of the run.
    jobs
        Largest number of processes of a stage.
    quiet
        Whether progress is hidden.
    hashes
        Digests of files; those of the outputs are added.
    progress
        Function that shows the progress of a stage.
    """

    loaded: LoadedConfig
    stages: Mapping[str, Stage]
    run_directory: Path
    logger: logging.Logger
    jobs: int
    quiet: bool
    hashes: FileHashes
    progress: MakesProgress = stage_progress

    def run(self, order: Order) -> Outcome:
        """Run a stage.

        Raises
        ------
        Exception
            Whatever the function of the stage raises; nothing is written then but complete outputs.
        """
        stage = self.stages[order.stage]
        part = PartWriter(stage.name, self.run_directory)
        started = time.monotonic()
        skipped = ""
        with self.progress(stage.name, self.logger, self.quiet) as progress:
            context = self._context(stage, order, part, progress)
            try:
                summary = stage.run(context)
            except StageSkipped as reason:
                summary, skipped = {}, str(reason)
                remove_outputs(stage, self.run_directory)
            except UserError as error:
                raise located(error, self.loaded) from error
        part.save()
        written = [] if skipped else [*stage.outputs, *part.files]
        outputs = {name: self.hashes.digest(self.run_directory / name) for name in written}
        seconds = time.monotonic() - started
        failed = "; ".join(context.failures)
        manifest = Manifest(
            stage.name, order.key, outputs, plain(summary), context.warnings, skipped, round(seconds, 3), failed
        )
        manifest.save(self.run_directory / MANIFESTS)
        if skipped:
            self.logger.info("%-20s skipped: %s", stage.name, skipped)
        else:
            self.logger.info("%-20s done in %.1f s", stage.name, seconds)
        return Outcome(stage.name, "skipped" if skipped else "built", manifest, order.reasons)

    def _context(self, stage: Stage, order: Order, part: PartWriter, progress: Progress) -> StageContext:
        seed = self.loaded.config.seed
        return StageContext(
            stage=stage.name,
            settings=SettingsView(self.loaded.config, stage.settings, stage.name),
            inputs=order.inputs,
            run_directory=self.run_directory,
            rng=np.random.default_rng(seed_of(seed, stage.name)),
            seed=seed,
            jobs=self.jobs,
            progress=progress,
            report=part,
            log=self.logger,
            provenance=Provenance(
                stage.name,
                self.loaded.as_yaml(),
                files_read(order.inputs, order.key.settings, stage.public_data, self.hashes),
                seed,
                order.key.inputs,
            ),
        )


def remove_outputs(stage: Stage, run_directory: Path) -> None:
    """Remove what an earlier run of a stage wrote."""
    for name in stage.outputs:
        path = run_directory / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def seed_of(seed: int, name: str) -> list[int]:
    """Return the entropy of the generator of a stage, from seed and stage name, so that stages are independent."""
    return [seed, int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big")]
