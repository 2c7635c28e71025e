"""Log messages of other packages."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator


@contextlib.contextmanager
def errors_only(name: str) -> Iterator[None]:
    """Let a package log errors only while the context lasts; afterwards its loggers have the levels of before.

    Parameters
    ----------
    name
        Name of the package. Loggers of its modules count as well, because some packages give each of them a level.
    """
    known = [key for key in logging.root.manager.loggerDict if key.startswith(f"{name}.")]
    loggers = [logging.getLogger(key) for key in (name, *known)]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
