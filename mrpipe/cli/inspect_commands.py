"""`show`, `check` and `init`: look at files, check a configuration, lay out a rig of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from mrpipe.cli.options import CommonOptions, with_common_options
from mrpipe.errors import UserError

_NOT_FOR_FILES = ("config", "run", "overrides", "settings", "campaign", "jobs", "seed", "force", "quiet")


@with_common_options(*_NOT_FOR_FILES)
def show(
    options: CommonOptions,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Artifact (.h5), campaign directory or campaign file.")],
    plot: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Also draw the channels (or datasets) into this picture.")
    ] = None,
) -> None:
    """Show what an artifact or a campaign holds."""
    from mrpipe.cli.output import print_json
    from mrpipe.reporting.contents import describe_file, plot_file, print_description

    if not file.exists():
        raise UserError(file, "", "no such file or directory", "give an artifact (.h5) or a campaign")
    if plot is not None and plot.suffix.lower() not in {".png", ".svg", ".pdf"}:
        raise UserError("--plot", str(plot), "is no picture", "end it in .png, .svg or .pdf")
    description = describe_file(file)
    if plot is not None:
        plot_file(file, plot)
        description["plot"] = str(plot)
    if options.json:
        print_json(description)
    else:
        print_description(description)


@with_common_options("config", "run", "campaign", "jobs", "seed", "force", "quiet")
def check(
    options: CommonOptions,
    config: Annotated[
        Path | None, typer.Argument(metavar="CONFIG", help="Configuration file. Default: configs/thesis.yaml.")
    ] = None,
    explain: Annotated[bool, typer.Option("--explain", help="List every setting with its meaning and value.")] = False,
) -> None:
    """Check a configuration and its campaigns."""
    from mrpipe.campaigns import load_campaign
    from mrpipe.cli.output import print_json
    from mrpipe.config.loader import default_config_path, load_config
    from mrpipe.config.model import options as all_options
    from mrpipe.config.sections.campaigns import LABORATORY
    from mrpipe.pipeline.settings_view import SettingsView, setting_named
    from mrpipe.stages.registry import stage_named

    loaded = load_config(config or default_config_path(), options.overrides, options.settings)
    for name in loaded.config.stages:
        stage = None if name == "report" else stage_named(name)
        if stage is not None and stage.check is not None:
            stage.check(SettingsView(loaded.config, stage.settings, name))
    campaigns: dict[str, Any] = {}
    for rig, source in loaded.config.campaigns.model_dump().items():
        if source is None or source == LABORATORY:
            campaigns[rig] = source or "none"
            continue
        campaign = load_campaign(Path(source))
        campaigns[rig] = f"{campaign.name}: {len(campaign.recordings)} tests"
    if explain:
        content = [
            {
                "setting": name,
                "meaning": text,
                "value": None if "[]" in name else _shown(setting_named(loaded.config, name)),
            }
            for name, text, _ in all_options()
        ]
        if options.json:
            print_json(content)
        else:
            for row in content:
                value = "" if row["value"] is None else f" = {row['value']}"
                print(f"{row['setting']}{value}\n    {row['meaning']}")
        return
    result = {"config": str(loaded.path), "valid": True, "stages": list(loaded.config.stages), "campaigns": campaigns}
    if options.json:
        print_json(result)
    else:
        print(f"{loaded.path}: valid, {len(loaded.config.stages)} stages")
        for rig, text in campaigns.items():
            print(f"  campaign {rig}: {text}")


def _shown(value: Any) -> str | None:
    """Return a single value as text; sections have none of their own."""
    import json

    return None if hasattr(value, "model_dump") else json.dumps(value, default=str)


@with_common_options(*_NOT_FOR_FILES)
def init(
    options: CommonOptions,
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory to lay out; made if missing.")],
) -> None:
    """Lay out a project for a rig of one's own."""
    from mrpipe.cli.output import print_json
    from mrpipe.cli.project import lay_out

    written = lay_out(directory)
    if options.json:
        print_json({"directory": str(directory), "written": [str(path) for path in written]})
        return
    for path in written:
        print(path)
    print(f"next: fill in {directory / 'data' / 'my-rig' / 'campaign.yaml'},")
    print(f"then: cd {directory} && mrpipe run configs/my-rig.yaml")


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(name="show")(show)
    app.command(name="check")(check)
    app.command(name="init")(init)
