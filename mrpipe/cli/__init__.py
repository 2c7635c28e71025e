"""The command line: `mrpipe STAGE`, `mrpipe run CONFIG` and the commands that look at what is there."""

from __future__ import annotations

import os
import sys

INTERRUPTED = 130
WRONG_INPUT = 2
CHECK_FAILED = 1
_RESUME = "interrupted; the next call resumes at the first unfinished stage"


def main(arguments: list[str] | None = None) -> None:
    """Run the program and leave with its exit status: 0 done, 1 check failed, 2 wrong input, 130 interrupted."""
    sys.exit(run(arguments))


def run(arguments: list[str] | None = None) -> int:
    """Run one command and return the exit status; a user's mistake is one line on standard error."""
    import typer

    from mrpipe.cli.app import app
    from mrpipe.errors import CheckFailed, MrpipeError

    try:
        command = typer.main.get_command(app)
        status = command.main(args=arguments, prog_name="mrpipe", standalone_mode=False)
    except KeyboardInterrupt:
        return _say(_RESUME, INTERRUPTED)
    except CheckFailed as error:
        return _say(str(error), CHECK_FAILED)
    except MrpipeError as error:
        return _say(str(error), WRONG_INPUT)
    except BrokenPipeError:
        # the reader of our output has gone (`mrpipe … | head`); nothing is left to be told
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CHECK_FAILED
    except typer.Abort:
        return _say(_RESUME, INTERRUPTED)
    except Exception as error:
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        return _say(" ".join(str(message()).split()), WRONG_INPUT)
    if status == INTERRUPTED:  # what typer makes of Ctrl-C
        return _say(_RESUME, INTERRUPTED)
    return int(status) if isinstance(status, int) else 0


def _say(message: str, status: int) -> int:
    print(f"mrpipe: {message}", file=sys.stderr)
    return status
