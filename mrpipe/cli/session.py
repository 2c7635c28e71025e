"""From the options of a command to a pipeline in a locked run directory."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mrpipe.cli.options import CommonOptions
from mrpipe.errors import UserError
from mrpipe.words import listed, shell_word

if TYPE_CHECKING:
    from mrpipe.config.loader import LoadedConfig
    from mrpipe.pipeline.execution import Outcome, StageRunner
    from mrpipe.pipeline.runner import Pipeline


def load(options: CommonOptions) -> LoadedConfig:
    """Read the configuration that the options name, with their overrides."""
    from mrpipe.config.loader import default_config_path, load_config

    overrides = list(options.overrides)
    if options.seed is not None:
        overrides.append(f"seed={options.seed}")
    if options.campaign is not None:
        overrides = [*_of_campaign(options.campaign, default=options.config is None), *overrides]
    path = options.config or default_config_path()
    if options.config is None and options.campaign is None and not options.quiet and not Path("configs").is_dir():
        print(
            "mrpipe: there is no project here (no folder configs): the virtual rig of the thesis is used. "
            "`mrpipe init DIR` makes a project, `mrpipe demo` shows the program in a few minutes.",
            file=sys.stderr,
        )
    return load_config(path, overrides, options.settings)


def _of_campaign(path: Path, *, default: bool) -> list[str]:
    """Return the settings that a campaign on the command line stands for: its place, and the run's name and title.

    The default configuration does not look for modes over amplitude, because its virtual frame is linear. A measured
    frame may depend on the amplitude, so that the search is on where `default` says that no configuration was named.
    """
    import json
    import re

    from mrpipe.campaigns.header import read_header

    name, key = read_header(path).campaign, rig_key(path)
    stem = re.sub(r"[^\w.+-]+", "-", name).strip("-.") or "campaign"
    settings: dict[str, str | bool] = {
        f"campaigns.{key}": _absolute(path),
        "name": stem,
        "description": f"Measured campaign {name}.",
        "report.title": name,
    }
    if default and key == "frame":
        settings["identify_frame.amplitude_dependence"] = True
    return [f"{setting}={json.dumps(value, ensure_ascii=False)}" for setting, value in settings.items()]


def _absolute(path: Path) -> str:
    return str(path.resolve())


def rig_key(path: Path) -> str:
    """Return which entry of `campaigns` a campaign belongs to: bench, frame or closed_loop."""
    from mrpipe.campaigns.header import read_header

    header = read_header(path)
    if header.rig == "damper-bench":
        return "bench"
    return "closed_loop" if header.kinds == {"closed-loop"} else "frame"


def run_directory(options: CommonOptions, loaded: LoadedConfig) -> Path:
    """Return the run directory."""
    from mrpipe.config.located import located

    if options.run is not None and str(options.run) in {"", "."}:
        raise UserError("--run", repr(str(options.run)), "is the working directory", "name another directory")
    name = loaded.config.name
    if options.run is None and (not name or name != Path(name).name or name in {".", ".."}):
        wrong = UserError("name", repr(name), "is not the name of a directory", "leave out / and ..")
        raise located(wrong, loaded)
    directory = options.run or Path("runs") / name
    if directory.exists() and not directory.is_dir():
        raise UserError("--run", str(directory), "is a file", "give a directory")
    return directory


def require_stages(loaded: LoadedConfig) -> None:
    """Refuse a configuration that lists an unknown stage.

    Raises
    ------
    UserError
        If there is one; the message names its line where the file of the configuration lists it.
    """
    from mrpipe.artifacts.yaml_source import read_yaml
    from mrpipe.stages.registry import stage_named

    for index, name in enumerate(loaded.config.stages):
        if name == "report":
            continue
        try:
            stage_named(name)
        except UserError as error:
            source = read_yaml(loaded.path)
            written = source.content.get("stages")
            if not isinstance(written, list) or tuple(written) != loaded.config.stages:
                raise
            raise source.error(("stages", index), f"no such stage {name!r}", error.remedy) from None


def pipeline_of(options: CommonOptions, loaded: LoadedConfig, *, to_log: bool = True) -> Pipeline:
    """Return the pipeline; nothing is locked yet, and only the log is written (with `to_log`)."""
    import logging

    from mrpipe.pipeline.progress import LOGGER_NAME, make_logger
    from mrpipe.pipeline.runner import Pipeline
    from mrpipe.stages.registry import stages_for

    require_stages(loaded)
    directory = run_directory(options, loaded)
    execution = loaded.config.execution
    logger = (
        make_logger(directory / "log.txt", execution.log_level, options.quiet)
        if to_log
        else logging.getLogger(LOGGER_NAME)
    )
    return Pipeline(
        loaded=loaded,
        stages=stages_for(loaded.config, rig_key(options.campaign) if options.campaign else ""),
        run_directory=directory,
        logger=logger,
        jobs=options.jobs or execution.jobs or os.cpu_count() or 1,
        quiet=options.quiet,
        campaign_given=options.campaign is not None,
    )


def stage_runner(options: CommonOptions) -> StageRunner:
    """Return the object that runs stages in another process: same configuration, without the log file of the run."""
    loaded = load(replace(options, quiet=True))
    pipeline = pipeline_of(options, loaded, to_log=False)
    pipeline.logger.setLevel(loaded.config.execution.log_level.upper())
    return pipeline.runner


def _warn_of_another_configuration(options: CommonOptions, loaded: LoadedConfig, directory: Path) -> None:
    """Say that a run directory was made with another configuration, where the command names none."""
    from mrpipe.artifacts.yaml_source import read_yaml

    kept = directory / "config.yaml"
    if options.config is not None or options.campaign is not None or options.quiet or not kept.is_file():
        return
    try:
        name = read_yaml(kept).content.get("name")
    except UserError:
        return  # a damaged copy is written anew
    if name != loaded.config.name:
        print(
            f"mrpipe: {directory} was made with the configuration {name}, and this command uses {loaded.config.name}: "
            f"every stage that it needs is built again with that. To go on with {name}: --config {shell_word(kept)}",
            file=sys.stderr,
        )


def _require_own(directory: Path) -> None:
    """Refuse a directory with files that no run has written, because the run would write over files of these names.

    A run that was killed before its first stage ended has left its lock and its configuration, or its lock and its log.
    """
    from mrpipe.pipeline.runner import LOG

    if not directory.is_dir() or (directory / "manifests").is_dir():
        return
    there = sorted(path.name for path in directory.iterdir() if not path.name.startswith("."))
    if (directory / ".lock").exists() and ("config.yaml" in there or there == [LOG]):
        return
    if there:
        named = listed(there) if len(there) <= 3 else f"{', '.join(there[:3])} and more"
        problem = f"holds {named}, which no run has written"
        raise UserError("--run", str(directory), problem, "give an empty or new directory")


@contextmanager
def session(options: CommonOptions) -> Iterator[Pipeline]:
    """Yield a pipeline that holds its run directory.

    A refusal leaves nothing in a new directory, and the configuration of an existing one as it was.
    """
    from mrpipe.artifacts import atomic_path
    from mrpipe.pipeline.lock import run_lock

    loaded = load(options)
    directory = run_directory(options, loaded)
    _require_own(directory)
    new = [folder for folder in (directory, *directory.parents) if not folder.exists()]
    with run_lock(directory):
        kept = directory / "config.yaml"
        before = kept.read_bytes() if kept.is_file() else None
        outcomes: Mapping[str, Outcome] = {}
        try:
            _warn_of_another_configuration(options, loaded, directory)
            pipeline = pipeline_of(options, loaded)
            outcomes = pipeline.outcomes
            pipeline.write_config()
            yield pipeline
        except (UserError, MemoryError):
            if new:
                _remove_without_results(new)
            elif before is not None and not any(item.what == "built" for item in outcomes.values()):
                # the results are still those of the configuration that was kept
                with atomic_path(kept) as temporary:
                    temporary.write_bytes(before)
            raise


def _remove_without_results(folders: Sequence[Path]) -> None:
    """Remove a new run directory that holds no result, and the folders above it that were made for it.

    Parameters
    ----------
    folders
        Folders that did not exist before, innermost first.
    """
    from mrpipe.pipeline.execution import MANIFESTS
    from mrpipe.pipeline.progress import close_logger
    from mrpipe.pipeline.runner import LOG

    directory = folders[0]
    manifests = directory / MANIFESTS
    own = {directory / name for name in (".lock", ".lock-holder", "config.yaml", LOG)}
    files = [path for path in directory.rglob("*") if not path.is_dir()]
    if any(path not in own and path.parent != manifests for path in files):
        return
    close_logger()
    for path in files:
        with suppress(OSError):
            path.unlink()
    for folder in (manifests, *folders):
        with suppress(OSError):
            folder.rmdir()
