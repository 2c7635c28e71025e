"""One run at a time in a run directory."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mrpipe.errors import UserError


@contextmanager
def run_lock(run_directory: Path) -> Iterator[None]:
    """Hold the run directory; the lock dies with the process, so a killed run leaves none behind.

    Raises
    ------
    UserError
        If another process holds it.
    """
    from filelock import FileLock, Timeout

    run_directory.mkdir(parents=True, exist_ok=True)
    holder = run_directory / ".lock-holder"
    lock = FileLock(run_directory / ".lock")
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        who = holder.read_text(encoding="utf-8").strip() if holder.is_file() else "another process"
        raise UserError(
            run_directory,
            "",
            f"is in use by {who}",
            "wait for it to end, or give another directory with --run",
        ) from error
    try:
        holder.write_text(f"process {os.getpid()}\n", encoding="utf-8")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()
