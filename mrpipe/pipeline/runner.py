"""Execution of the stages in order, with reuse of results that are up to date, and the reasons for stale ones."""

from __future__ import annotations

import errno
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mrpipe.artifacts import atomic_write_text
from mrpipe.config.loader import LoadedConfig
from mrpipe.config.located import located
from mrpipe.errors import MrpipeError, StageFailed, UserError
from mrpipe.pipeline.code_version import code_version
from mrpipe.pipeline.execution import MANIFESTS, Order, Outcome, StageRunner, remove_outputs
from mrpipe.pipeline.fingerprint import FileHashes, plain_settings
from mrpipe.pipeline.manifest import Manifest, StageKey, reasons_stale
from mrpipe.pipeline.settings_view import SettingsView
from mrpipe.pipeline.sources import ABSENT, Sources
from mrpipe.pipeline.stage import Stage

LOG = "log.txt"
PUBLIC_DATA = "public data"


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
        Directory of artifacts, manifests, log, figures, tables and report.
    logger
        Logger of the run.
    jobs
        Largest number of processes.
    quiet
        Whether progress is hidden.
    campaign_given
        The user named a campaign on the command line. Data of the virtual laboratory are then used only if a stage
        requires them, or if they exist already.
    keep_going
        A stage that fails does not end the run: stages that need it are skipped, all others are built.
    force
        Stages that are built even if nothing changed.
    outcomes
        Stage -> its result in this call.
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
        self._manifests = self.run_directory / MANIFESTS
        self.hashes = FileHashes(self._manifests / ".hashes.json")
        self.sources = Sources(self.loaded, self.stages, self.run_directory, self.hashes)

    @property
    def runner(self) -> StageRunner:
        """Runner of a single stage."""
        return StageRunner(
            self.loaded, self.stages, self.run_directory, self.logger, self.jobs, self.quiet, self.hashes
        )

    # --- building ----------------------------------------------------------------------------------------------------
    def build(self, name: str) -> Outcome:
        """Bring one stage and everything that it needs up to date.

        Raises
        ------
        MrpipeError
            If it fails and the run does not keep going; otherwise the outcome reports the failure.
        """
        begun = self.begin(name)
        return begun if isinstance(begun, Outcome) else self.finish(begun, lambda: self.runner.run(begun))

    def begin(self, name: str) -> Outcome | Order:
        """Bring everything that a stage needs up to date; return its outcome, or the order to run it.

        Raises
        ------
        MrpipeError
            If that fails and the run does not keep going; otherwise the outcome reports the failure.
        """
        if name in self.outcomes:
            return self.outcomes[name]
        stage = self.stages[name]
        try:
            begun = self._begin(stage)
        except Exception as error:
            return self._keep(self._outcome_of(stage, error))
        return self._keep(begun) if isinstance(begun, Outcome) else begun

    def finish(self, order: Order, result: Callable[[], Outcome]) -> Outcome:
        """Record what became of a stage that ran.

        Parameters
        ----------
        order
            The stage.
        result
            Returns its outcome, or raises what the stage raised.

        Raises
        ------
        MrpipeError
            If it failed and the run does not keep going; otherwise the outcome reports the failure.
        """
        try:
            outcome = result()
        except Exception as error:
            outcome = self._outcome_of(self.stages[order.stage], error)
        return self._keep(outcome)

    def _outcome_of(self, stage: Stage, error: Exception) -> Outcome:
        if not self.keep_going or _ends_the_run(error):
            raise error
        return self._failed(stage, error)

    def _keep(self, outcome: Outcome) -> Outcome:
        self.outcomes[outcome.stage] = outcome
        self.hashes.save()
        if outcome.what in {"built", "reused"} and (mixed := self.sources.mixed_with_laboratory(outcome.stage)):
            self.logger.warning("%s: %s", outcome.stage, mixed)
        return outcome

    def _begin(self, stage: Stage) -> Outcome | Order:
        self.check(stage.name)
        missing = ""
        # inputs that no campaign can give come first, so that nothing is built for a stage that is then skipped
        for item in sorted(stage.inputs, key=self.sources.configured):
            missing = missing or self._provide(item, stage.inputs)
        missing += self.sources.demanded_by_settings(stage) if missing else ""
        for item in () if missing else stage.preferred_inputs:
            if self.sources.configured(item):
                self._provide_preferred(item)
        together = all(self._is_to_be_had(item) for item in stage.optional_inputs)
        for item in stage.optional_inputs:
            if self._wanted(item, together):
                self._provide_optional(item)
        return self._skip(stage, missing) if missing else self._reuse_or_run(stage)

    def _failed(self, stage: Stage, error: Exception) -> Outcome:
        """Record a failure: outputs of an earlier run are kept and count as stale."""
        text = " ".join(str(error).split())
        if isinstance(error, OSError) and error.filename and error.strerror:
            text = f"{error.filename}: {error.strerror.lower()}"
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
            If it cannot work with them; the message names the file and the line of the setting.
        """
        stage = self.stages[name]
        try:
            if stage.check is not None:
                stage.check(SettingsView(self.loaded.config, stage.settings, name))
        except UserError as error:
            raise located(error, self.loaded) from error

    def _is_to_be_had(self, name: str) -> bool:
        """Return whether an optional input is available: with a given campaign, no other one is recorded."""
        if not self.sources.configured(name):
            return False
        provider = self.sources.provider(name)
        spared = provider is not None and self.campaign_given and self.sources.needs_laboratory(name)
        return not spared or (provider is not None and self.is_fresh(provider))

    def _wanted(self, name: str, together: bool) -> bool:
        """Return whether to bring an optional input up to date.

        Optional inputs are used together: if one is not available, the others are not built either. Those that are up
        to date are always used.
        """
        provider = self.sources.provider(name)
        if provider is None or provider in self.outcomes:
            return True
        if not together or (self.campaign_given and self.sources.needs_laboratory(name)):
            return self.is_fresh(provider)
        return True

    def _provide(self, name: str, required: Sequence[str] = ()) -> str:
        """Build an input; return the reason if it is not available, else an empty text.

        Raises
        ------
        StageFailed
            If a required input failed in this run.
        """
        provider = self.sources.provider(name)
        if provider is None:
            if self.sources.path(name) is None:
                return self.sources.no_campaign(name, campaign_given=self.campaign_given)
            return ""
        outcome = self.build(provider)
        if outcome.what == "failed" and name in required:
            raise StageFailed(f"not built, because {provider} failed")
        return outcome.manifest.skipped

    def _provide_preferred(self, name: str) -> None:
        """Build an input that the stage can do without; wrong settings of its stage end the run as for any input."""
        provider = self.sources.provider(name)
        if provider is not None and provider not in self.outcomes:
            self.check(provider)
        self._provide_optional(name)

    def _provide_optional(self, name: str) -> None:
        """Build an optional input; if that fails, the stage runs without it."""
        keep_going, self.keep_going = self.keep_going, True
        try:
            self._provide(name)
        finally:
            self.keep_going = keep_going

    def is_fresh(self, name: str) -> bool:
        """Return whether a stage and all that it needs are up to date."""
        stage = self.stages[name]
        for item in stage.inputs:
            provider = self.sources.provider(item)
            if provider is not None and not self.is_fresh(provider):
                return False
        manifest = Manifest.load(self._manifests, name)
        if manifest is None or manifest.skipped:
            return False
        return not reasons_stale(manifest, self._key(stage, self._inputs_there(stage)), self.run_directory, self.hashes)

    def _inputs_there(self, stage: Stage) -> dict[str, Path]:
        inputs = {}
        for name in dict.fromkeys(stage.all_inputs):
            path = self.sources.path(name)
            if path is None or not path.exists():
                if name in stage.inputs and path is not None:
                    inputs[name] = path
                continue
            if name not in stage.inputs and not self._usable(name):
                continue
            inputs[name] = path
        return inputs

    def _usable(self, name: str) -> bool:
        """Return whether an existing optional input belongs to this configuration."""
        provider = self.sources.provider(name)
        if provider is None:
            return True
        if provider in self.outcomes:
            return self.outcomes[provider].what in {"built", "reused"}
        return self.is_fresh(provider)

    def _key(self, stage: Stage, inputs: Mapping[str, Path]) -> StageKey:
        digests = {name: self.sources.digest(name, path) for name, path in inputs.items()}
        for name in stage.all_inputs[len(stage.inputs) :]:
            digests.setdefault(name, ABSENT)
        if stage.public_data:
            digests[PUBLIC_DATA] = self.sources.digest_of_public_data(stage.public_data)
        settings = plain_settings(self.loaded.config, stage.settings, self.hashes)
        code = code_version(stage.run.__module__)
        return StageKey(digests, settings, code, self.loaded.config.seed)

    def _reuse_or_run(self, stage: Stage) -> Outcome | Order:
        inputs = self._inputs_there(stage)
        key = self._key(stage, inputs)
        manifest = Manifest.load(self._manifests, stage.name)
        reasons = (
            ["--force"] if stage.name in self.force else reasons_stale(manifest, key, self.run_directory, self.hashes)
        )
        if not reasons and manifest is not None:
            self.logger.info(
                "%-20s up to date%s",
                stage.name,
                f" (skipped: {manifest.skipped})" if manifest.skipped else "",
            )
            return Outcome(stage.name, "skipped" if manifest.skipped else "reused", manifest)
        self.logger.info("%-20s starts: %s", stage.name, "; ".join(reasons))
        return Order(stage.name, key, inputs, reasons)

    def _skip(self, stage: Stage, reason: str) -> Outcome:
        self.logger.info("%-20s skipped: %s", stage.name, reason)
        manifest = Manifest(stage.name, StageKey({}, {}, {}, self.loaded.config.seed), {}, {}, [], reason)
        remove_outputs(stage, self.run_directory)
        manifest.save(self._manifests)
        return Outcome(stage.name, "skipped", manifest)

    def write_config(self) -> None:
        """Keep the resolved configuration in the run directory."""
        atomic_write_text(self.run_directory / "config.yaml", self.loaded.as_yaml())

    # --- what a stage waits for ---------------------------------------------------------------------------------------
    def plan(self, names: Sequence[str]) -> list[str]:
        """Return the named stages and those that :meth:`build` would bring up to date for them, in order."""
        found: set[str] = set()

        def add(name: str) -> None:
            if name in found:
                return
            found.add(name)
            stage = self.stages[name]
            given = [item for item in stage.inputs if self.sources.configured(item)]
            preferred = [item for item in stage.preferred_inputs if self.sources.configured(item)]
            together = all(self._is_to_be_had(item) for item in stage.optional_inputs)
            wanted = [item for item in stage.optional_inputs if self._wanted(item, together)]
            # a stage that lacks a campaign is skipped: nothing is built for it
            for item in [*([*given, *preferred] if len(given) == len(stage.inputs) else []), *wanted]:
                if (provider := self.sources.provider(item)) is not None:
                    add(provider)

        for name in names:
            add(name)
        return [name for name in self.stages if name in found]

    def waits_for(self, name: str) -> set[str]:
        """Return the stages whose results a stage may read."""
        stage = self.stages[name]
        return {provider for item in stage.all_inputs if (provider := self.sources.provider(item)) is not None}

    # --- reporting what is stale --------------------------------------------------------------------------------------
    def status(self, names: Sequence[str]) -> dict[str, list[str]]:
        """Return stage -> reasons why it would run, for the named stages and all they need; empty means up to date."""
        found: dict[str, list[str]] = {}
        for name in names:
            self._status_of(name, found)
        self.hashes.save()
        order = list(self.stages)
        return dict(sorted(found.items(), key=lambda item: order.index(item[0])))

    def _status_of(self, name: str, found: dict[str, list[str]]) -> list[str]:
        if name in found:
            return found[name]
        stage = self.stages[name]
        manifest = Manifest.load(self._manifests, name)
        reasons: list[str] = []
        stale: list[str] = []
        for item in (*stage.inputs, *stage.preferred_inputs, *stage.optional_inputs):
            provider = self.sources.provider(item)
            if provider is None:
                if item in stage.inputs and self.sources.path(item) is None:
                    found[name] = ["skipped: no " + item.partition(":")[2] + " campaign"]
                    return found[name]
            elif before := self._status_of(provider, found):
                if before[0].startswith("skipped"):
                    if item in stage.inputs:
                        found[name] = before
                        return before
                elif before != ["never built"] or item in stage.inputs or not _ran_without(manifest, item):
                    reasons.append(f"{provider}, which it reads, is stale")
                    stale.append(f"input {item} ")
        own = reasons_stale(manifest, self._key(stage, self._inputs_there(stage)), self.run_directory, self.hashes)
        # the artifact of a stale stage is there, but does not count: "missing" would send people to look for the file
        own = [reason for reason in own if not reason.startswith(tuple(stale))]
        found[name] = own if own[:1] == ["never built"] else reasons + own
        return found[name]


def _ran_without(manifest: Manifest | None, item: str) -> bool:
    """Return whether a stage ran without an optional input, as `close-loop --campaign` does if there is no frame."""
    return manifest is not None and not manifest.skipped and manifest.key.inputs.get(item) == ABSENT


def _ends_the_run(error: Exception) -> bool:
    """Return whether no other stage can be built either: the disk is full or cannot be written."""
    return isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG}
