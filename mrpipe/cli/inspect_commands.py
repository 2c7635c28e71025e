"""`show`, `check` and `init`: show files, check a configuration, create a project."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mrpipe.cli.options import CommonOptions, with_common_options
from mrpipe.errors import UserError
from mrpipe.words import counted, listed, shell_word, shortest

if TYPE_CHECKING:
    from mrpipe.cli.checking import CheckResult
    from mrpipe.cli.project import Project
    from mrpipe.config.model import RunSettings

_NOT_FOR_FILES = ("config", "run", "overrides", "settings", "campaign", "jobs", "seed", "force")


@with_common_options(*_NOT_FOR_FILES)
def show(
    options: CommonOptions,
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Campaign, run directory, artifact (.h5), JSON result or data file.")
    ],
    plot: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="Also draw the channels (or datasets) into this file (.png, .svg or .pdf)."),
    ] = None,
) -> None:
    """Show what a campaign, run directory, artifact, JSON result or data file holds."""
    from mrpipe.cli.output import print_json
    from mrpipe.cli.showing import describe_any, print_any

    if not file.exists():
        raise UserError(
            file, "", "no such file or directory", "give a campaign, a run directory, an artifact or a file"
        )
    if plot is not None and plot.suffix.lower() not in {".png", ".svg", ".pdf"}:
        raise UserError("--plot", str(plot), "is not a picture", "end it in .png, .svg or .pdf")
    try:
        description = describe_any(file)
    except (OSError, RuntimeError, KeyError) as error:
        # the library that reads HDF5 does not name the file
        of_system = isinstance(error, OSError) and error.errno is not None
        if of_system or file.suffix.lower() not in {".h5", ".hdf5"}:
            raise
        problem = f"is damaged ({' '.join(str(error).split())[:120]})"
        raise UserError(file, "", problem, "build it again with --force") from error
    if plot is not None:
        from mrpipe.reporting.contents import plot_file

        if description["kind"] not in {"campaign", "artifact"}:
            raise UserError("--plot", str(file), "cannot be drawn", "name a campaign or an artifact")
        plot_file(file, plot)
        description["plot"] = str(plot)
    if options.json:
        print_json(description)
    else:
        print_any(description)


@with_common_options("jobs", "force")
def check(
    options: CommonOptions,
    explain: Annotated[bool, typer.Option("--explain", help="List every setting with its meaning and value.")] = False,
) -> None:
    """Check a configuration and its campaigns.

    The findings on the measured data are those of `mrpipe show`. The exit status is 1 if a finding is an error.
    """
    from mrpipe.cli import checking
    from mrpipe.cli.output import print_json
    from mrpipe.cli.session import load, run_directory
    from mrpipe.errors import CheckFailed

    loaded = load(replace(options, quiet=True))
    run_directory(options, loaded)  # refuses a name that cannot be that of a directory
    checking.check_stages(loaded)
    if explain:
        _explain(loaded.config, options.json)
        return
    checking.check_headers(loaded)
    without = checking.stages_without_data(loaded)
    result = checking.check_campaigns(loaded)
    count = counted(result.errors, "error")
    named = f"campaign {options.campaign}" if options.campaign else shortest(loaded.path)
    stages = list(loaded.config.stages)
    if options.json:
        print_json(
            {
                "config": str(loaded.path),
                "valid": result.errors == 0,
                "stages": stages,
                "skipped": without,
                **result.as_dict(),
            }
        )
    else:
        verdict = f"{count} in the data" if result.errors else "valid"
        print(f"{named}: {verdict}, {counted(len(stages), 'stage')}")
        _print_findings(result, without)
        if not result.errors:
            needs_config = options.config is not None or options.campaign is None
            config = [shell_word(options.config or shortest(loaded.path))] if needs_config else []
            print("next: mrpipe run " + " ".join([*config, *options.changes_in_words()]))
    if result.errors:
        raise CheckFailed(f"{named}: {count} in the measured data (listed above)")


def _explain(config: RunSettings, as_json: bool) -> None:
    """Print every setting with its meaning and value."""
    from mrpipe.cli.output import print_json
    from mrpipe.config.model import options as all_options
    from mrpipe.pipeline.settings_view import setting_named

    content = [
        {
            "setting": name,
            "meaning": text,
            "value": None if "[]" in name else _shown(setting_named(config, name)),
        }
        for name, text, _ in all_options()
    ]
    if as_json:
        print_json(content)
        return
    for row in content:
        value = "" if row["value"] is None else f" = {row['value']}"
        print(f"{row['setting']}{value}\n    {row['meaning']}")


def _print_findings(result: CheckResult, without: Mapping[str, str]) -> None:
    """Print the findings on every campaign, and the stages that have no data."""
    for rig, text in result.campaigns.items():
        print(f"  campaign {rig}: {text}")
        for note in result.notes.get(rig, []):
            print(f"    note: {note}")
        for item in result.findings.get(rig, []):
            print(f"    {item.severity}: {item.line}")
    for stage, campaign in without.items():
        print(f"  {stage}: will be skipped, because there is no {campaign} campaign")


def _shown(value: Any) -> str | None:
    """Return a single value as text; sections have no value."""
    import json

    if hasattr(value, "model_dump"):
        return None
    return json.dumps(
        value, default=lambda item: item.model_dump(mode="json") if hasattr(item, "model_dump") else str(item)
    )


@with_common_options(*_NOT_FOR_FILES)
def init(
    options: CommonOptions,
    directory: Annotated[
        Path,
        typer.Argument(
            metavar="DIR",
            help="Directory of the project. It is created if it is missing, and its name is the name of the project.",
        ),
    ],
    source: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FOLDER",
            help="Folder of measured files. Channels, units, signs and roles are proposed from headers and samples.",
        ),
    ] = None,
    rig: Annotated[
        str | None,
        typer.Option(metavar="RIG", help="bench, frame or both. Default: bench; with --from, what the files contain."),
    ] = None,
) -> None:
    """Create a project for your own rig."""
    from mrpipe.artifacts.yaml_source import nearest
    from mrpipe.cli.output import print_json
    from mrpipe.cli.project import lay_out

    if rig not in (None, "bench", "frame", "both"):
        raise UserError("--rig", str(rig), "is not a rig", nearest(str(rig), ("bench", "frame", "both")))
    project = lay_out(directory, rig, source)  # type: ignore[arg-type]
    if options.json:
        print_json(
            {
                "directory": str(directory),
                "name": project.name,
                "written": [str(path) for path in project.written],
                "campaigns": [
                    {
                        "rig": item.rig,
                        "channels": item.channels,
                        "tests": [{"name": name, "role": role} for name, role in item.tests],
                        "unsure": list(item.unsure),
                        "skipped": list(item.skipped),
                    }
                    for item in project.proposals
                ],
            }
        )
        return
    _print_project(project, directory)


def _print_project(project: Project, directory: Path) -> None:
    """Print the files that were written, the proposals for the campaigns, and the next steps."""
    from mrpipe.campaigns.model import CAMPAIGN_FILE

    for path in project.written:
        print(path)
    for item in project.proposals:
        print(f"{item.rig}: {counted(len(item.tests), 'test')}")
        for channel, column in item.channels.items():
            print(f"  {channel}: {column}")
        for name, role in item.tests:
            print(f"  {name}: {role}")
        for line in item.unsure:
            print(f"  check: {line}")
        for line in item.skipped:
            print(f"  not used: {line}")
    unsure = any(item.unsure for item in project.proposals)
    verb = "check the lines marked UNSURE in" if unsure else "check" if project.proposals else "fill in"
    files = listed([str(directory / item / CAMPAIGN_FILE) for item in project.campaigns])
    print(f"next: {verb} {files},")
    config = shell_word(f"configs/{project.name}.yaml")
    print(f"then: cd {shell_word(directory)} && mrpipe check {config} && mrpipe run {config}")


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(name="show")(show)
    app.command(name="check")(check)
    app.command(name="init")(init)
