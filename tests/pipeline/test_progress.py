"""Progress shows one remaining time."""

from __future__ import annotations

import io
import logging
from pathlib import Path

import pytest

from mrpipe.pipeline import progress


@pytest.mark.property
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("refined 10 of 16, 23 s left", "sweep: 75 %: refined 10 of 16, 23 s left"),
        ("refined 10 of 16", "sweep: 75 % (about 3 s left): refined 10 of 16"),
    ],
)
def test_a_line_carries_one_remaining_time(
    text: str, expected: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    clock = iter([0.0, 10.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    logger = logging.getLogger("progress of a test")
    with caplog.at_level(logging.INFO, logger=logger.name):
        progress._lines("sweep", logger)(0.75, text)
    assert caplog.messages == [expected]


@pytest.mark.property
def test_a_log_line_goes_to_what_standard_error_is_now(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bar takes the place of standard error while it is shown, so that lines do not run into it."""
    logger = progress.make_logger(tmp_path / "log.txt", "info", quiet=False)
    now = io.StringIO()
    monkeypatch.setattr(progress.sys, "stderr", now)
    logger.info("above the bar")
    assert now.getvalue() == "above the bar\n"
