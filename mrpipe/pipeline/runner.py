"""Runs stages in order, reuses what is up to date, says what is stale and why."""

from __future__ import annotations

import errno
import hashlib
import logging
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrpipe.artifacts import Provenance, atomic_write_text, public_data_directory
from mrpipe.artifacts.plain import plain
from mrpipe.config.loader import LoadedConfig
from mrpipe.config.sections.campaigns import LABORATORY
from mrpipe.errors import MrpipeError, StageFailed, StageSkipped
from mrpipe.pipeline.code_version import code_version
from mrpipe.pipeline.fingerprint import FileHashes, plain_settings
from mrpipe.pipeline.manifest import Manifest, StageKey, reasons_stale
from mrpipe.pipeline.parts import PartWriter
from mrpipe.pipeline.progress import stage_progress
from mrpipe.pipeline.settings_view import SettingsView
from mrpipe.pipeline.stage import Stage, StageContext

CAMPAIGN_RECORDERS = {"bench": "record-bench", "frame": "record-frame", "closed-loop": "record-closed-loop"}
ABSENT = "absent"
LOG = "log.txt"
PUBLIC_DATA = "public data"


@dataclass(frozen=True)
class Outcome:
    """What became of one stage: `built`, `reused`, `skipped` or `failed`."""

    stage: str
    what: str
    manifest: Manifest
    reasons: Sequence[str] = ()


@dataclass
class Pipeline:
    """The stages of one configuration in one run directory.

    Attributes
    ----------
    loaded
        The configuration.
    stages
        Name -> stage, in order.
    run_directory
        Where artifacts, manifests, log, figures, tables and report go.
    jobs
        Processes to use.
    keep_going
        A stage that fails does not end the run: stages that need it are left out, all others are built.
    campaign_given
        The user named a campaign on the command line: what the virtual laboratory could add is then used only where
        a stage cannot do without it, or where it is there already.
    logger
        Takes the log lines.
    quiet
        Show no progress.
    force
        Stages that are built even where nothing changed.
    outcomes
        Stage -> what became of it in this call.
    errors
        Errors that ended stages in this call.
    """

    loaded: LoadedConfig
    stages: Mapping[str, Stage]
    run_directory: Path
    logger: logging.Logger
    jobs: int = 1
    quiet: bool = False
    campaign_given: bool = False
    keep_going: bool = False
    force: frozenset[str] = frozenset()
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    errors: list[Exception] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.stages = {name: stage.for_configuration(self.loaded.config) for name, stage in self.stages.items()}
        self._manifests = self.run_directory / "manifests"
        self._hashes = FileHashes(self.run_directory / "manifests" / ".hashes.json")

    # --- what a stage needs ------------------------------------------------------------------------------------------
    def campaign_source(self, rig: str) -> str | None:
        """Return the configured campaign of a rig: a path, `laboratory`, or None."""
        source: str | None = getattr(self.loaded.config.campaigns, rig.replace("-", "_"))
        return source

    def provider(self, name: str) -> str | None:
        """Return the stage that makes an input, or None where it comes from outside."""
        if not name.startswith("campaign:"):
            return name
        rig = name.partition(":")[2]
        return CAMPAIGN_RECORDERS[rig] if self.campaign_source(rig) == LABORATORY else None

    def needs_laboratory(self, name: str) -> bool:
        """Return whether an input can only be had by recording on the virtual rig, directly or further up."""
        provider = self.provider(name)
        if provider is None:
            return False
        return provider in CAMPAIGN_RECORDERS.values() or any(
            self.needs_laboratory(item) for item in self.stages[provider].inputs
        )

    def input_path(self, name: str) -> Path | None:
        """Return where an input is (whether built or not), or None where the configuration has none."""
        provider = self.provider(name)
        if provider is not None:
            return self.run_directory / self.stages[provider].outputs[0]
        source = self.campaign_source(name.partition(":")[2])
        return None if source is None else Path(source)

    def _digest_of_input(self, name: str, path: Path) -> str:
        if name.startswith("campaign:"):
            from mrpipe.campaigns import campaign_files

            files = campaign_files(path)
            base = path if path.is_dir() else path.parent
            return self._hashes.digest_many(files, base)
        return self._hashes.digest(path)

    def _digest_of_public_data(self, folders: Sequence[str]) -> str:
        base = public_data_directory()
        there = [] if base is None else [base / name for name in folders if (base / name).is_dir()]
        return self._hashes.digest_many(there, base) if base is not None and there else ABSENT

    # --- building ----------------------------------------------------------------------------------------------------
    def build(self, name: str) -> Outcome:
        """Bring one stage up to date, and all that it needs before it.

        Raises
        ------
        MrpipeError
            If it fails, unless the run is to keep going: then the outcome says so.
        """
        if name in self.outcomes:
            return self.outcomes[name]
        stage = self.stages[name]
        try:
            outcome = self._build(stage)
        except Exception as error:
            if not self.keep_going or _ends_the_run(error):
                raise
            outcome = self._failed(stage, error)
        self.outcomes[name] = outcome
        self._hashes.save()
        return outcome

    def _build(self, stage: Stage) -> Outcome:
        self.check(stage.name)
        missing = ""
        for item in stage.inputs:
            missing = missing or self._provide(item, stage.inputs)
        together = all(self._is_to_be_had(item) for item in stage.optional_inputs)
        for item in stage.optional_inputs:
            if self._wanted(item, together):
                self._provide_optional(item)
        return self._skip(stage, missing) if missing else self._run_or_reuse(stage)

    def _failed(self, stage: Stage, error: Exception) -> Outcome:
        """Record a failure: what lies there of an earlier run stays, and counts as stale."""
        text = " ".join(str(error).split())
        if not isinstance(error, MrpipeError | OSError | MemoryError):
            text = f"{type(error).__name__}: {text} (a fault of the program; {LOG} has the details)"
            self.logger.error("%s", stage.name, exc_info=error, extra={"file_only": True})
        said = text if isinstance(error, StageFailed) else f"failed: {text}"
        self.logger.error("%-20s %s", stage.name, said)
        self.errors.append(error)
        manifest = Manifest(stage.name, StageKey({}, {}, {}, self.loaded.config.seed), {}, {}, [], said, failed=text)
        manifest.save(self._manifests)
        return Outcome(stage.name, "failed", manifest)

    def check(self, name: str) -> None:
        """Let a stage check its settings, so that a mistake is reported before any work is done.

        Raises
        ------
        UserError
            If it cannot work with them.
        """
        stage = self.stages[name]
        if stage.check is not None:
            stage.check(SettingsView(self.loaded.config, stage.settings, name))

    def _can_be_had(self, name: str) -> bool:
        """Return whether the campaigns that an input hangs on are configured."""
        provider = self.provider(name)
        if provider is None:
            return self.input_path(name) is not None
        return all(self._can_be_had(item) for item in self.stages[provider].inputs)

    def _is_to_be_had(self, name: str) -> bool:
        """Return whether an optional input is available: with a given campaign, no other one is recorded."""
        if not self._can_be_had(name):
            return False
        provider = self.provider(name)
        spared = provider is not None and self.campaign_given and self.needs_laboratory(name)
        return not spared or (provider is not None and self._is_fresh(provider))

    def _wanted(self, name: str, together: bool) -> bool:
        """Return whether to bring an optional input up to date: they serve together, so one that lacks spares all.

        What is there and up to date is used in any case.
        """
        provider = self.provider(name)
        if provider is None or provider in self.outcomes:
            return True
        if not together or (self.campaign_given and self.needs_laboratory(name)):
            return self._is_fresh(provider)
        return True

    def _provide(self, name: str, required: Sequence[str] = ()) -> str:
        """Build an input; return why it cannot be had, or nothing.

        Raises
        ------
        StageFailed
            If a required input failed in this run.
        """
        provider = self.provider(name)
        if provider is None:
            if self.input_path(name) is None:
                rig = name.partition(":")[2]
                given = "the one given with --campaign is of another kind; " if self.campaign_given else ""
                return f"there is no {rig} campaign ({given}give campaigns.{rig.replace('-', '_')}, or --campaign DIR)"
            return ""
        outcome = self.build(provider)
        if outcome.what == "failed" and name in required:
            raise StageFailed(f"not built, because {provider} failed")
        return outcome.manifest.skipped

    def _provide_optional(self, name: str) -> None:
        """Build an optional input; where that fails, the stage does without it."""
        keep_going, self.keep_going = self.keep_going, True
        try:
            self._provide(name)
        finally:
            self.keep_going = keep_going

    def _is_fresh(self, name: str) -> bool:
        stage = self.stages[name]
        for item in stage.inputs:
            provider = self.provider(item)
            if provider is not None and not self._is_fresh(provider):
                return False
        manifest = Manifest.load(self._manifests, name)
        if manifest is None or manifest.skipped:
            return False
        return not reasons_stale(
            manifest, self._key(stage, self._inputs_there(stage)), self.run_directory, self._hashes
        )

    def _inputs_there(self, stage: Stage) -> dict[str, Path]:
        inputs = {}
        for name in (*stage.inputs, *stage.optional_inputs):
            path = self.input_path(name)
            if path is None or not path.exists():
                if name in stage.inputs and path is not None:
                    inputs[name] = path
                continue
            if name in stage.optional_inputs and not self._usable(name):
                continue
            inputs[name] = path
        return inputs

    def _usable(self, name: str) -> bool:
        """Return whether an optional input that lies there belongs to this configuration."""
        provider = self.provider(name)
        if provider is None:
            return True
        if provider in self.outcomes:
            return self.outcomes[provider].what in {"built", "reused"}
        return self._is_fresh(provider)

    def _key(self, stage: Stage, inputs: Mapping[str, Path]) -> StageKey:
        digests = {
            name: self._digest_of_input(name, path) if path.exists() else ABSENT for name, path in inputs.items()
        }
        for name in stage.optional_inputs:
            digests.setdefault(name, ABSENT)
        if stage.public_data:
            digests[PUBLIC_DATA] = self._digest_of_public_data(stage.public_data)
        settings = plain_settings(self.loaded.config, stage.settings, self._hashes)
        code = code_version(stage.run.__module__)
        return StageKey(digests, settings, code, self.loaded.config.seed)

    def _run_or_reuse(self, stage: Stage) -> Outcome:
        inputs = self._inputs_there(stage)
        key = self._key(stage, inputs)
        manifest = Manifest.load(self._manifests, stage.name)
        reasons = (
            ["--force"] if stage.name in self.force else reasons_stale(manifest, key, self.run_directory, self._hashes)
        )
        if not reasons and manifest is not None:
            self.logger.info(
                "%-20s up to date%s",
                stage.name,
                f" (skipped: {manifest.skipped})" if manifest.skipped else "",
            )
            return Outcome(stage.name, "skipped" if manifest.skipped else "reused", manifest)
        self.logger.info("%-20s starts: %s", stage.name, "; ".join(reasons))
        return self._run(stage, key, inputs, reasons)

    def _run(self, stage: Stage, key: StageKey, inputs: Mapping[str, Path], reasons: Sequence[str]) -> Outcome:
        part = PartWriter(stage.name, self.run_directory)
        started = time.monotonic()
        skipped = ""
        with stage_progress(stage.name, self.logger, self.quiet) as progress:
            context = StageContext(
                stage=stage.name,
                settings=SettingsView(self.loaded.config, stage.settings, stage.name),
                inputs=inputs,
                run_directory=self.run_directory,
                rng=np.random.default_rng(seed_of(self.loaded.config.seed, stage.name)),
                seed=self.loaded.config.seed,
                jobs=self.jobs,
                progress=progress,
                report=part,
                log=self.logger,
                provenance=Provenance(stage.name, self.loaded.as_yaml(), key.inputs, self.loaded.config.seed),
            )
            try:
                summary = stage.run(context)
            except StageSkipped as reason:
                summary, skipped = {}, str(reason)
                self._remove_outputs(stage)
        part.save()
        written = [] if skipped else [*stage.outputs, *part.files]
        outputs = {name: self._hashes.digest(self.run_directory / name) for name in written}
        seconds = time.monotonic() - started
        failed = "; ".join(context.failures)
        manifest = Manifest(
            stage.name, key, outputs, plain(summary), context.warnings, skipped, round(seconds, 3), failed
        )
        manifest.save(self._manifests)
        self._hashes.save()
        if skipped:
            self.logger.info("%-20s skipped: %s", stage.name, skipped)
        else:
            self.logger.info("%-20s done in %.1f s", stage.name, seconds)
        return Outcome(stage.name, "skipped" if skipped else "built", manifest, reasons)

    def _skip(self, stage: Stage, reason: str) -> Outcome:
        self.logger.info("%-20s skipped: %s", stage.name, reason)
        manifest = Manifest(stage.name, StageKey({}, {}, {}, self.loaded.config.seed), {}, {}, [], reason)
        self._remove_outputs(stage)
        manifest.save(self._manifests)
        return Outcome(stage.name, "skipped", manifest)

    def _remove_outputs(self, stage: Stage) -> None:
        for name in stage.outputs:
            path = self.run_directory / name
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def write_config(self) -> None:
        """Keep the resolved configuration in the run directory."""
        atomic_write_text(self.run_directory / "config.yaml", self.loaded.as_yaml())

    # --- saying what is stale ----------------------------------------------------------------------------------------
    def status(self, names: Sequence[str]) -> dict[str, list[str]]:
        """Return stage -> reasons why it would run, for the named stages and all they need; empty means up to date."""
        found: dict[str, list[str]] = {}
        for name in names:
            self._status_of(name, found)
        self._hashes.save()
        order = list(self.stages)
        return dict(sorted(found.items(), key=lambda item: order.index(item[0])))

    def _status_of(self, name: str, found: dict[str, list[str]]) -> list[str]:
        if name in found:
            return found[name]
        stage = self.stages[name]
        reasons: list[str] = []
        for item in (*stage.inputs, *stage.optional_inputs):
            provider = self.provider(item)
            if provider is None:
                if item in stage.inputs and self.input_path(item) is None:
                    found[name] = ["skipped: no " + item.partition(":")[2] + " campaign"]
                    return found[name]
            elif before := self._status_of(provider, found):
                if before[0].startswith("skipped"):
                    if item in stage.inputs:
                        found[name] = before
                        return before
                else:
                    reasons.append(f"{provider}, which it reads, is stale")
        manifest = Manifest.load(self._manifests, name)
        own = reasons_stale(manifest, self._key(stage, self._inputs_there(stage)), self.run_directory, self._hashes)
        found[name] = own if own[:1] == ["never built"] else reasons + own
        return found[name]


def _ends_the_run(error: Exception) -> bool:
    """Return whether no other stage can be built either: the disk is full or cannot be written."""
    return isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG}


def seed_of(seed: int, name: str) -> list[int]:
    """Return the entropy of a stage's generator: run's seed and stage's name, so that stages do not share draws."""
    return [seed, int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big")]
