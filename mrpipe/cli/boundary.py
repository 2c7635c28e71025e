"""The one place where errors become a line for the user and an exit status."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Sequence
from contextlib import suppress

from mrpipe.errors import CheckFailed, MrpipeError, StagesRefused, UserError
from mrpipe.words import listed

INTERRUPTED = 130
WRONG_INPUT = 2
CHECK_FAILED = 1
RESUME = "interrupted; the next call resumes at the first unfinished stage"

_REMEDIES = {
    errno.ENOSPC: "make space on this disk, then call again: the run resumes",
    errno.EFBIG: "raise the limit of the file size, then call again: the run resumes",
    errno.EDQUOT: "make space within your quota, then call again: the run resumes",
    errno.EACCES: "give permission, or choose another directory (for a run: --run DIR)",
    errno.EPERM: "give permission, or choose another directory (for a run: --run DIR)",
    errno.EROFS: "choose a directory that is not read-only (for a run: --run DIR)",
    errno.ENOENT: "name an existing file or directory",
    errno.EEXIST: "choose another name: this is a file, or a link to a place that does not exist",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
}
_HDF5_WORDS = ("hdf5", "h5", "unable to", "can't ", "filter returned failure", "object header", "chunk")


def as_user_error(error: BaseException) -> MrpipeError | None:
    """Return the error as one line for the user; None where it is a fault of the program, which needs its traceback."""
    if isinstance(error, MrpipeError):
        return error
    if isinstance(error, OSError):
        return _of_system(error)
    if isinstance(error, MemoryError):
        said = f": {error}" if str(error) else ""
        return UserError("memory", "", f"is exhausted{said}", "use shorter tests, a lower rate, or --jobs 1")
    if isinstance(error, RecursionError):
        return UserError("input", "", "is nested too deeply", "give a file with less nesting")
    if isinstance(error, EOFError):
        return UserError("input", "", "ends too early: a file is damaged", "build it again with --force")
    if isinstance(error, UnicodeEncodeError):
        return UserError("output", "", f"cannot be written as {error.encoding}", "set PYTHONIOENCODING=utf-8")
    if isinstance(error, RuntimeError | KeyError) and any(word in str(error).lower() for word in _HDF5_WORDS):
        return UserError("HDF5 file", "", f"is damaged ({_line(error)})", "build it again with --force")
    return None


def _of_system(error: OSError) -> UserError:
    names = [str(name) for name in (error.filename, error.filename2) if name is not None]
    if error.errno is None:  # h5py raises errors without a number
        return UserError(listed(names) or "file", "", f"cannot be used ({_line(error)})", "build it again")
    remedy = _REMEDIES.get(error.errno, "check the path and the disk")
    return UserError(listed(names) or "system", "", os.strerror(error.errno).lower(), remedy)


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())[:200]


def exit_with(error: BaseException, arguments: Sequence[str]) -> int:
    """Report an error and return the exit status.

    With `--json` the error is also one JSON document on standard output, except where a check or single stages failed:
    the document of the command has been printed then.

    Raises
    ------
    BaseException
        The error itself where it is a fault of the program.
    """
    import typer

    aborted = isinstance(error, typer.Abort)
    if aborted and isinstance(error.__cause__ or error.__context__, EOFError):
        error = EOFError()
    elif aborted or isinstance(error, KeyboardInterrupt):
        return say(RESUME, INTERRUPTED)
    if isinstance(error, BrokenPipeError):
        # the reader of our output has gone (`mrpipe ... | head`): nobody is left to read a message
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CHECK_FAILED
    if isinstance(error, CheckFailed):
        return say(str(error), WRONG_INPUT if isinstance(error, StagesRefused) else CHECK_FAILED)
    known = as_user_error(error)
    if known is None and not isinstance(error, Exception):
        raise error
    if known is None:
        said = getattr(error, "format_message", None)
        if said is None:
            raise error
        text = " ".join(str(said()).split())
        if text.startswith("No such command") and "Did you mean" not in text:
            text += " `mrpipe help` lists the commands."
        known = MrpipeError(text)
    if "--json" in arguments:
        with suppress(OSError):
            print(json.dumps({"error": as_document(known)}, indent=2), flush=True)
    return say(str(known), WRONG_INPUT)


def as_document(error: MrpipeError) -> dict[str, str | int]:
    """Return an error as the document that `--json` prints."""
    parts = {key: getattr(error, key, "") for key in ("source", "where", "problem", "remedy")}
    return {"message": str(error), **parts, "exit_status": WRONG_INPUT}


def say(message: str, status: int) -> int:
    """Print a message on standard error and return the status."""
    print(f"mrpipe: {message}", file=sys.stderr)
    return status


def prepare_streams() -> None:
    """Make standard output and error usable: a closed one swallows, one that is not UTF-8 shows escapes."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, PTH123
        elif hasattr(stream, "reconfigure") and (stream.encoding or "").lower().replace("-", "") != "utf8":
            stream.reconfigure(errors="backslashreplace")
