"""Progress shows one remaining time."""

from __future__ import annotations

import logging

import pytest

from mrpipe.pipeline import progress


@pytest.mark.property
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("refined 10 of 16, 23 s left", "sweep: 75 % refined 10 of 16, 23 s left"),
        ("refined 10 of 16", "sweep: 75 %, about 3 s left refined 10 of 16"),
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
