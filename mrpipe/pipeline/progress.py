"""Progress: bars on a terminal, log lines elsewhere; always on standard error."""

from __future__ import annotations

import logging
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mrpipe.artifacts import Progress
from mrpipe.words import in_percent

LOGGER_NAME = "mrpipe"
_LOG_EVERY_S = 10.0
_LEFT = re.compile(r",? *(about )?[\d.]+ (s|min|h) left")


def make_logger(log_file: Path, level: str, quiet: bool) -> logging.Logger:
    """Return a logger that writes to `log_file` and, unless `quiet`, to standard error."""
    logger = close_logger()
    logger.setLevel(level.upper())
    logger.propagate = False
    log_file.parent.mkdir(parents=True, exist_ok=True)
    to_file = logging.FileHandler(log_file, encoding="utf-8")
    to_file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logger.addHandler(to_file)
    to_error = _ToStandardError()
    to_error.setFormatter(logging.Formatter("%(message)s"))
    to_error.setLevel(logging.ERROR if quiet else level.upper())
    to_error.addFilter(lambda record: not getattr(record, "file_only", False))
    logger.addHandler(to_error)
    return logger


def close_logger() -> logging.Logger:
    """Close the log file of the run, if there is one; return the logger without handlers."""
    logger = logging.getLogger(LOGGER_NAME)
    for handler in list(logger.handlers):
        logger.removeHandler(handler)
        handler.close()
    return logger


class _ToStandardError(logging.Handler):
    """Writes to what standard error is when a line comes: while bars are shown, lines are written above them."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            print(self.format(record), file=sys.stderr, flush=True)
        except Exception:
            self.handleError(record)


def shows_bars(quiet: bool) -> bool:
    """Return whether progress is shown as bars: on a terminal only."""
    return sys.stderr.isatty() and not quiet


@contextmanager
def stage_progress(stage: str, logger: logging.Logger, quiet: bool) -> Iterator[Progress]:
    """Yield the `progress` that a stage reports to."""
    if not shows_bars(quiet):
        yield _lines(stage, logger)
        return
    bars = StageBars(quiet)
    bars.update(stage, 0.0)
    try:
        yield lambda fraction, text="": bars.update(stage, fraction, text)
    finally:
        bars.close()


class StageBars:
    """One bar for each stage that runs; nothing where standard error is not a terminal.

    Parameters
    ----------
    quiet
        Whether nothing is shown.
    """

    def __init__(self, quiet: bool) -> None:
        self._shown = shows_bars(quiet)
        self._bar: Any = None
        self._rows: dict[str, Any] = {}

    def update(self, stage: str, fraction: float, text: str = "") -> None:
        """Show the share of a stage that is done, and a text."""
        if not self._shown:
            return
        if self._bar is None:
            self._bar = _empty_bar()
            self._bar.start()
        if stage not in self._rows:
            self._rows[stage] = self._bar.add_task(stage, total=1.0, note="")
        # the bar shows the remaining time already
        self._bar.update(self._rows[stage], completed=fraction, note=_LEFT.sub("", text))

    def remove(self, stage: str) -> None:
        """Remove the bar of a stage that has ended."""
        if stage in self._rows:
            self._bar.remove_task(self._rows.pop(stage))
        if not self._rows:
            self.close()

    def close(self) -> None:
        """Remove all bars."""
        if self._bar is not None:
            self._bar.stop()
        self._bar = None
        self._rows = {}


def _empty_bar() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns: list[Any] = [
        TextColumn("{task.description:>20}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    ]
    return Bar(*columns, console=Console(stderr=True), transient=True)


def _lines(stage: str, logger: logging.Logger) -> Progress:
    started = last = time.monotonic()

    def progress(fraction: float, text: str = "") -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _LOG_EVERY_S:
            last = now
            left = (now - started) * (1 - fraction) / fraction if fraction > 0.02 else float("nan")
            # a stage that knows its remaining time reports it
            remaining = f" (about {left:.0f} s left)" if left == left and not _LEFT.search(text) else ""
            logger.info("%s: %s%s: %s", stage, in_percent(fraction), remaining, text)

    return progress
