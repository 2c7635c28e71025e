"""The command line: `mrpipe STAGE`, `mrpipe run CONFIG` and the commands that look at what is there."""

from __future__ import annotations

import sys


def main(arguments: list[str] | None = None) -> None:
    """Run the program and leave with its exit status: 0 done, 1 check failed, 2 wrong input, 130 interrupted."""
    sys.exit(run(arguments))


def run(arguments: list[str] | None = None) -> int:
    """Run one command and return the exit status; a user's mistake is one line on standard error."""
    import typer

    from mrpipe.cli import boundary
    from mrpipe.cli.app import app

    given = sys.argv[1:] if arguments is None else arguments
    boundary.prepare_streams()
    try:
        command = typer.main.get_command(app)
        status = command.main(args=given, prog_name="mrpipe", standalone_mode=False)
        sys.stdout.flush()
    except BaseException as error:
        if isinstance(error, SystemExit | GeneratorExit):
            raise
        return boundary.exit_with(error, given)
    if status == boundary.INTERRUPTED:  # what typer makes of Ctrl-C
        return boundary.say(boundary.RESUME, boundary.INTERRUPTED)
    return int(status) if isinstance(status, int) else 0
