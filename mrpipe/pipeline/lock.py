"""Lock that permits one run at a time in a run directory."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mrpipe.errors import UserError

_TEMPORARY = re.compile(r"\..+\.\d+(\.old)?\.tmp")


@contextmanager
def run_lock(run_directory: Path) -> Iterator[None]:
    """Lock the run directory; the lock ends with the process, so that a killed run leaves no lock.

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
        remove_temporaries(run_directory)
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def remove_temporaries(run_directory: Path) -> None:
    """Remove incomplete files and folders of killed processes: `.NAME.PID.tmp` and `.NAME.PID.old.tmp`.

    Call it only while the lock is held, because then no other process writes here.
    """
    for path in sorted(run_directory.rglob(".*.tmp")):
        if not _TEMPORARY.fullmatch(path.name):
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink()
