"""All commands of the program."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from mrpipe.cli import (
    benchmark_command,
    compare_command,
    demo_command,
    effect_command,
    inspect_commands,
    run_commands,
    stage_commands,
)
from mrpipe.errors import UserError

GROUPS = {
    "Start": ("init", "demo", "check", "show", "help"),
    "Whole runs": ("run", "status", "report", "compare"),
    "Damper": ("prepare", "identify-damper", "close-loop", "assemble", "sweep", "train-forward", "train-inverse"),
    "Structure and control": ("identify-frame", "calibrate", "design", "simulate", "export"),
    "Virtual laboratory, benchmarks, own effects": ("record", "benchmark", "reproduce", "check-effect"),
}
"""Headings of the help -> commands; others are listed at the end."""
EXAMPLES = (
    ("mrpipe demo", "run a virtual damper from the first measurement to the verdict"),
    ("mrpipe init my-rig --from DATA", "create a project from measured files"),
    ("mrpipe run", "run all stages of the project in this folder"),
    ("mrpipe close-loop --campaign DIR", "find the effect that the model of this damper lacks"),
    ("mrpipe status runs/my-rig", "show what is out of date, and why"),
    ("mrpipe compare runs/before runs/after", "show settings, data and results that differ"),
)

DESCRIPTION = """From bench tests of a magnetorheological (MR) damper to the closed loop with a structure, and back to
the physical effect that the model lacks.

Every stage is a command; `mrpipe run CONFIG` runs all of them in order. The command of a stage first builds the stages
before it that are missing or out of date. Numbers are SI; --json prints one JSON document.
"""
"""Text above the list of commands."""


class Commands(TyperGroup):
    """The commands under headings, and examples below."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands group by group, then examples."""
        texts = {}
        for name in self.list_commands(ctx):
            command = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                texts[name] = command.get_short_help_str(limit=130)
        listed = {name for names in GROUPS.values() for name in names}
        others = {"Further stages": tuple(name for name in texts if name not in listed)}
        for heading, names in {**GROUPS, **others}.items():
            rows = [(name, texts[name]) for name in names if name in texts]
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)
        with formatter.section("Examples"):
            formatter.write_dl(EXAMPLES)


app = typer.Typer(
    name="mrpipe",
    cls=Commands,
    help=DESCRIPTION,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)


@app.callback(invoke_without_command=True)
def version(
    context: typer.Context,
    show: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)] = False,
) -> None:
    """Print the version, or the help if no command is given."""
    if show:
        from mrpipe import __version__

        print(f"mrpipe {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command(name="help")
def help_of(
    context: typer.Context,
    command: Annotated[
        str | None,
        typer.Argument(metavar="COMMAND", help="Command whose help is shown. Default: the list of commands."),
    ] = None,
) -> None:
    """Show the list of commands, or the help of one command."""
    top = context.find_root()
    if command is None:
        print(top.get_help())
        return
    group: Any = top.command
    found = group.get_command(top, command)
    if found is None:
        from mrpipe.artifacts.yaml_source import nearest

        raise UserError("help", command, "is not a command", nearest(command, group.list_commands(top)))
    print(found.get_help(typer.Context(found, info_name=command, parent=top)))


run_commands.register(app)
compare_command.register(app)
stage_commands.register(app)
benchmark_command.register(app)
inspect_commands.register(app)
effect_command.register(app)
demo_command.register(app)
