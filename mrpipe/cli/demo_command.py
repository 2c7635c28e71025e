"""`mrpipe demo`: a virtual damper that hides an effect, from the first measurement to the verdict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import typer

from mrpipe.cli.options import CommonOptions, with_common_options
from mrpipe.cli.run_commands import run_stages


@with_common_options("config", "campaign")
def demo(options: CommonOptions) -> None:
    """Run all stages on a virtual damper with an effect that is hidden from the estimators."""
    from mrpipe.artifacts import config_directory

    directory = options.run or Path("runs") / "demo"
    run_stages(replace(options, config=config_directory() / "demo.yaml", run=directory))
    if not options.json:
        print(f"the hidden effect of this damper is written in {directory / 'campaigns' / 'bench.truth'}")
        print(f"further commands work in this run, for example: mrpipe status {directory}")


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(name="demo")(demo)
