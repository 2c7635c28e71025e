"""Lists, counts and times in messages and reports."""

from __future__ import annotations

import pytest

from mrpipe.words import counted, duration, in_percent, listed, noun, shell_word

pytestmark = pytest.mark.property


def test_lists() -> None:
    assert [listed(list("abc")[:count]) for count in range(4)] == ["", "a", "a and b", "a, b and c"]


def test_counts() -> None:
    assert [counted(count, "test") for count in (0, 1, 2)] == ["0 tests", "1 test", "2 tests"]
    assert [noun(count, "degree") for count in (0, 1, 6)] == ["degrees", "degree", "degrees"]


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.2, "0 s"), (119.4, "119 s"), (120.0, "2 min"), (7199.0, "120 min"), (7200.0, "2.0 h")]
)
def test_times(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_a_path_is_one_word_of_a_shell() -> None:
    import shlex
    from pathlib import Path

    for path in ("runs/a", "Mein Projekt ß", "it's"):
        assert shlex.split(f"cd {shell_word(Path(path))}") == ["cd", path]
    assert shell_word("runs/a") == "runs/a"


def test_percentages() -> None:
    assert [in_percent(0.934), in_percent(-0.05, 1), in_percent(0.5, signed=True)] == ["93 %", "-5.0 %", "+50 %"]
