"""`run`, `report` and `status`: the pipeline as a whole."""

from __future__ import annotations

import functools
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mrpipe.cli.options import CommonOptions, one_config, with_common_options
from mrpipe.errors import CheckFailed, StagesRefused, UserError
from mrpipe.words import counted, shell_word, shortest

if TYPE_CHECKING:
    from mrpipe.pipeline.runner import Pipeline


@with_common_options()
def run(
    options: CommonOptions,
    until: Annotated[str | None, typer.Option(metavar="STAGE", help="Stop after this stage.")] = None,
) -> None:
    """Run every stage that the configuration lists.

    Nothing is built where the configuration or a measured campaign is wrong: the exit status is 2. A stage that fails
    later does not end the run: only stages that need it are left out, and the report names what failed. The exit status
    is then 2 if the stage refused its input, else 1.
    """
    run_stages(options, until)


def run_stages(options: CommonOptions, until: str | None = None) -> None:
    """Run the stages that a configuration lists, and print the outcome of each.

    Raises
    ------
    UserError
        If the configuration or a measured campaign is wrong; nothing is built then.
    StagesRefused
        If a stage refused its input; it is raised after all results have been printed.
    CheckFailed
        The same, if a stage failed for another reason.
    """
    from mrpipe.cli.campaign_refusal import refuse_wrong_campaigns, refuse_wrong_settings
    from mrpipe.cli.checking import check_headers
    from mrpipe.cli.output import print_json
    from mrpipe.cli.session import session, stage_runner
    from mrpipe.pipeline.compile_ahead import compiled_ahead
    from mrpipe.pipeline.side_by_side import build_side_by_side

    started = time.monotonic()
    with session(options) as pipeline:
        check_headers(pipeline.loaded)
        names = _until(list(pipeline.loaded.config.stages), until)
        if options.force:
            pipeline.force = frozenset(pipeline.stages)
        pipeline.keep_going = True
        to_build = [name for name in names if name != "report"]
        _require_something_to_report(pipeline, to_build)
        refuse_wrong_settings(pipeline, to_build)
        refuse_wrong_campaigns(pipeline, to_build)
        with compiled_ahead([pipeline.stages[name].run.__module__ for name in to_build], pipeline.jobs) as compiling:
            build_side_by_side(pipeline, to_build, functools.partial(stage_runner, options), compiling)
        if pipeline.errors and not any(item.what in {"built", "reused"} for item in pipeline.outcomes.values()):
            raise pipeline.errors[0]
        report = _write_report(pipeline) if "report" in names else []
    content = _run_summary(pipeline, report, time.monotonic() - started)
    if options.json:
        print_json(content)
    else:
        _print_run(pipeline, content)
    if content["failed"]:
        said = f"{counted(len(content['failed']), 'stage')} failed or lack a part: {', '.join(content['failed'])}"
        refused = next((error for error in pipeline.errors if isinstance(error, UserError)), None)
        raise CheckFailed(said) if refused is None else StagesRefused(f"{refused} ({said})")


def _require_something_to_report(pipeline: Pipeline, to_build: list[str]) -> None:
    """Refuse a configuration that lists the report alone, in a run directory where no stage has run."""
    from mrpipe.config.located import located
    from mrpipe.pipeline.execution import MANIFESTS

    if not to_build and not (pipeline.run_directory / MANIFESTS).is_dir():
        problem = f"lists the report alone, and no stage has run in {pipeline.run_directory}"
        raise located(UserError("stages", "", problem, "list the stages that it should report"), pipeline.loaded)


def _until(names: list[str], until: str | None) -> list[str]:
    if until is None:
        return names
    from mrpipe.stages.registry import stage_named

    if until != "report":
        try:
            stage_named(until)
        except UserError as error:
            raise UserError("--until", until, error.problem, error.remedy) from None
    if until not in names:
        raise UserError("--until", until, "is not among the stages of the configuration", f"one of {', '.join(names)}")
    return names[: names.index(until) + 1]


def _run_summary(pipeline: Pipeline, report: list[Path], seconds: float) -> dict[str, Any]:
    from mrpipe.reporting.headlines import weak_network

    stages = {
        name: {
            "outcome": outcome.what,
            "seconds": outcome.manifest.seconds if outcome.what == "built" else 0.0,
            "reasons": list(outcome.reasons),
            **({"skipped": outcome.manifest.skipped} if outcome.what in {"skipped", "failed"} else {}),
            **({"failed": outcome.manifest.failed} if outcome.manifest.failed else {}),
            "warnings": outcome.manifest.warnings,
            "summary": outcome.manifest.summary,
        }
        for name, outcome in pipeline.outcomes.items()
    }
    weak = weak_network({name: outcome.manifest.summary for name, outcome in pipeline.outcomes.items()})
    return {
        "run": str(pipeline.run_directory),
        "seconds": seconds,
        "stages": stages,
        "report": [str(path) for path in report],
        "failed": [name for name, stage in stages.items() if "failed" in stage],
        "notes": [weak] if weak else [],
    }


def _print_run(pipeline: Pipeline, content: dict[str, Any]) -> None:
    from mrpipe.reporting.headlines import headline, in_brief

    for name, stage in content["stages"].items():
        text = stage.get("skipped") or headline(name, stage["summary"])
        print(f"{name:20} {stage['outcome']:8} {text}")
        for line in in_brief(name, stage["summary"]):
            print(f"{'':20} {line}")
        for warning in stage["warnings"]:
            print(f"{'':20} warning: {warning}")
    for note in content["notes"]:
        print(f"note: {note}")
    print(f"done in {content['seconds']:.1f} s, in {pipeline.run_directory}")
    for path in content["report"]:
        print(f"report: {path}")
    if content["failed"]:
        print(f"next: correct what failed, then the same command again; {pipeline.run_directory}/log.txt has details")
    elif content["report"]:
        print(f"next: open {content['report'][0]}, or mrpipe show {shell_word(pipeline.run_directory)}")
    else:
        print(f"next: mrpipe report {shell_word(pipeline.run_directory)}")


def _write_report(pipeline: Pipeline) -> list[Path]:
    from mrpipe.pipeline.report import run_facts
    from mrpipe.reporting.page import write_report

    return write_report(run_facts(pipeline), pipeline.loaded.config.report.formats)


@with_common_options("jobs", "force", "positional")
def report(
    options: CommonOptions,
    directory: Annotated[
        Path | None,
        typer.Argument(metavar="RUN", help="Run directory. Default: runs/NAME, with the name of the configuration."),
    ] = None,
    summary: Annotated[bool, typer.Option("--summary", help="Also print the first screen of the report.")] = False,
) -> None:
    """Write the report of a run (HTML and Markdown)."""

    from mrpipe.cli.output import print_json
    from mrpipe.cli.session import load, pipeline_of, run_directory

    options = _config_of_run(_run_or_config(options, directory))
    if options.run is not None:
        _require_run(options.run)
    loaded = load(options)
    _require_run(run_directory(options, loaded))
    pipeline = pipeline_of(options, loaded)
    paths = _write_report(pipeline)
    if options.json:
        print_json({"report": [str(path) for path in paths]})
    else:
        if summary:
            import shutil

            from mrpipe.pipeline.report import run_facts
            from mrpipe.reporting.page import first_screen

            columns = shutil.get_terminal_size((100, 24)).columns
            print("\n".join(first_screen(run_facts(pipeline), columns)), end="\n\n")
        for path in paths:
            print(f"report: {path}")


def _require_run(directory: Path) -> None:
    """Refuse a directory that no run has written, so that no report is written into it."""
    if not directory.is_dir():
        problem = "is a file and no run directory" if directory.exists() else "no such run directory"
        raise UserError(directory, "", problem, "name a directory that `mrpipe run` wrote, or run it first")
    if not (directory / "manifests").is_dir():
        problem = "is not a run directory, because it has no manifests of stages"
        raise UserError(directory, "", problem, "name a directory that `mrpipe run` wrote, such as runs/my-rig")


def _is_new(directory: Path) -> bool:
    """Return whether a directory is there and holds nothing yet."""
    return directory.is_dir() and not any(directory.iterdir())


def _run_or_config(options: CommonOptions, given: Path | None) -> CommonOptions:
    """Take a positional argument as the run directory, or as the configuration where it is a YAML file."""
    from dataclasses import replace

    if given is None:
        return options
    if given.suffix in {".yaml", ".yml"} and not given.is_dir():
        return replace(options, config=one_config(options.config, given))
    return replace(options, run=given)


def _config_of_run(options: CommonOptions) -> CommonOptions:
    """Take the configuration that a run directory was made with, where none is named."""
    from dataclasses import replace

    kept = options.run / "config.yaml" if options.run else None
    if options.config is None and kept is not None and kept.is_file():
        return replace(options, config=kept)
    return options


@with_common_options("jobs", "force", "positional")
def status(
    options: CommonOptions,
    directory: Annotated[
        Path | None,
        typer.Argument(metavar="RUN", help="Run directory. Default: runs/NAME, with the name of the configuration."),
    ] = None,
) -> None:
    """Show which stages are out of date, and why."""
    from mrpipe.cli.output import print_json
    from mrpipe.cli.session import load, pipeline_of

    options = _run_or_config(options, directory)
    if options.run is not None and not (_is_new(options.run) or (options.run / "config.yaml").is_file()):
        _require_run(options.run)
    loaded = load(_config_of_run(options))
    pipeline = pipeline_of(options, loaded, to_log=False)
    found = pipeline.status([name for name in loaded.config.stages if name != "report"])
    if options.json:
        print_json(
            {
                "run": str(pipeline.run_directory),
                "stages": {name: {"stale": bool(reasons), "reasons": reasons} for name, reasons in found.items()},
            }
        )
        return
    for name, reasons in found.items():
        print(f"{name:20} {'; '.join(reasons) if reasons else 'up to date'}")
    if any(reasons and not reasons[0].startswith("skipped") for reasons in found.values()):
        words = [shell_word(shortest(loaded.path)), *options.changes_in_words()]
        print(f"next: mrpipe run {' '.join(words)} --run {shell_word(pipeline.run_directory)}")


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(name="run")(run)
    app.command(name="report")(report)
    app.command(name="status")(status)
