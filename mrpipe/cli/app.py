"""All commands of the program."""

from __future__ import annotations

from typing import Annotated

import typer

from mrpipe.cli import benchmark_command, effect_command, inspect_commands, run_commands, stage_commands

app = typer.Typer(
    name="mrpipe",
    help="From measured magnetorheological dampers to a closed-loop run, and back to the effect a model lacks.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)


@app.callback(invoke_without_command=True)
def version(
    show: Annotated[bool, typer.Option("--version", help="Print the version and leave.", is_eager=True)] = False,
) -> None:
    """From measured magnetorheological dampers to a closed-loop run, and back to the effect a model lacks.

    Every stage is a command; `mrpipe run CONFIG` is all of them in order. A stage builds whatever before it is
    missing or out of date, and nothing else. Numbers are SI; --json prints one JSON document.
    """
    if show:
        from mrpipe import __version__

        print(f"mrpipe {__version__}")
        raise typer.Exit


run_commands.register(app)
stage_commands.register(app)
benchmark_command.register(app)
inspect_commands.register(app)
effect_command.register(app)
