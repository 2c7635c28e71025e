"""Files that are either the old or the new version, whatever kills the program."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def atomic_path(final: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `final`; it replaces `final` on success and is removed on failure.

    The data are flushed to the disk before the rename, so that a crash of the machine leaves a whole file too.
    """
    final = Path(final)
    final.parent.mkdir(parents=True, exist_ok=True)
    temporary = final.with_name(f".{final.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        with temporary.open("rb") as handle:
            os.fsync(handle.fileno())
        temporary.replace(final)
    except OSError as error:
        # a failed write has no name, and that of the temporary file means nothing to anybody
        if error.filename is None or str(error.filename) == str(temporary):
            error.filename, error.filename2 = str(final), None
        raise
    finally:
        # where nothing can be written, nothing can be removed, and the first error says why
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def atomic_write_text(final: Path, text: str) -> None:
    """Write `text` (UTF-8) to `final` atomically."""
    with atomic_path(final) as temporary:
        temporary.write_text(text, encoding="utf-8")


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's content in hexadecimal."""
    with Path(path).open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()
