"""Lists, counts and times in messages and reports."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import mrpipe
from mrpipe.errors import UserError
from mrpipe.words import counted, duration, in_percent, listed, noun, shell_word, shortest

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

    for path in ("runs/a", "Mein Projekt ß", "it's"):
        assert shlex.split(f"cd {shell_word(Path(path))}") == ["cd", path]
    assert shell_word("runs/a") == "runs/a"


def test_one_function_writes_percentages() -> None:
    local = re.compile(r"\{[^{}]*(:[^{}]*[defg]|number\([^{}]*\))\} %")
    package = Path(mrpipe.__file__).parent
    found = [
        f"{path.relative_to(package)}: {part[0]}"
        for path in package.rglob("*.py")
        if path.name != "words.py" or path.parent != package
        for part in local.finditer(path.read_text(encoding="utf-8"))
    ]
    assert not found, "mrpipe.words.in_percent writes a ratio in percent"


def test_an_exact_percentage_has_no_zeros_at_its_end() -> None:
    shown = [in_percent(ratio, digits=3, exact=True) for ratio in (0.05, 0.1, 0.125, 2.0, 1e-9)]
    assert shown == ["5 %", "10 %", "12.5 %", "200 %", "1e-07 %"]
    assert in_percent(None) == "-" and in_percent(None, digits=2) == "-"


def test_a_huge_percentage_has_an_exponent() -> None:
    assert [in_percent(-12345.678), in_percent(3.2e300, 1), in_percent(2e6, signed=True)] == [
        "-1234568 %",
        "3.20e+302 %",
        "+2.00e+08 %",
    ]


def test_percentages() -> None:
    assert [in_percent(0.934), in_percent(-0.05, 1), in_percent(0.5, signed=True)] == ["93 %", "-5.0 %", "+50 %"]


@pytest.mark.parametrize(
    ("ratio", "digits", "text"),
    [
        (0.0549, 2, "5.5 %"),
        (0.996, 2, "100 %"),
        (12.34, 3, "1230 %"),
        (0.0, 3, "0 %"),
        (-0.5, 3, "-50.0 %"),
        (float("nan"), 3, "-"),
    ],
)
def test_percentages_with_significant_digits_have_no_exponent(ratio: float, digits: int, text: str) -> None:
    assert in_percent(ratio, digits=digits) == text


def test_a_path_within_the_working_directory_is_shown_relative_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside, outside = tmp_path / "project" / "data" / "a.csv", tmp_path / "measured" / "a.csv"
    (tmp_path / "project").mkdir()
    monkeypatch.chdir(tmp_path / "project")
    assert shortest(inside) == "data/a.csv" and shortest(outside) == str(outside)
    assert shortest(Path.cwd()) == str(tmp_path / "project")
    assert UserError(inside, "row 3", "is empty", "fill it in").source == "data/a.csv"
    assert UserError("simulate.excitation", "file", "is missing", "name it").source == "simulate.excitation"
    monkeypatch.chdir("/")
    assert shortest(outside) == str(outside), "everything lies within the root"
