"""The package is written in plain technical English: words of a private style do not come back."""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.property

PACKAGE = Path(__file__).resolve().parents[1] / "mrpipe"

OPEN = ("tracing/bench/", "effects/rate_dependent_yield.py", "effects/yielding_parts.py")
"""Packages and modules that are still to be rewritten."""

BANNED = {
    r"\b(tells?|telling) (apart|of|the user|it|them)\b": "show, distinguish, report",
    r"\btold\b": "given, distinguished, reported",
    r"\bask(s|ed)? for\b": "require, request",
    r"(?<!-)\bbeside\b(?! *$)": "in addition to, compared with, next to",
    r"\bmend(s|ed|ing)?\b": "correct, repair",
    r"\bof (one's|its|their|our|your) own\b(?! [a-z])": "separate, another, or leave it out",
    r"\bwhat is left\b": "the rest, the residual",
    r"\b(nought|naught|aught)\b": "0, zero",
    r"\bthrice\b": "three times",
    r"\breckon(s|ed|ing)?\b": "estimate, expect",
    r"\bstands? twice\b": "appears twice",
    r"\bfor want of\b": "without",
    r"\bby and by\b": "gradually",
    r"\bto speak of\b": "significant",
    r"\bworth a word\b": "reported",
    r"\bhangs? together\b": "correlates",
    r"\bas much again\b": "twice",
    r"\b(lest|thereof|therein|whence|thither|yonder)\b": "plain words",
    r"\b(it|this|that|which) (is|was) no (?!(longer|less|more|larger|smaller|lower|higher|later)\b)": "is not a",
    r"\bwhat (it|they|a \w+|the \w+) makes? of\b": "result, effect",
}
"""Private style -> plain words instead."""


def _prose(source: str) -> Iterator[tuple[int, str]]:
    """Yield every line of the comments and strings of a module, with its number."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type in (tokenize.COMMENT, tokenize.STRING) or "FSTRING" in tokenize.tok_name[token.type]:
            for number, line in enumerate(token.string.splitlines()):
                yield token.start[0] + number, line


def banned(source: str) -> list[str]:
    """Return the lines of a module's comments and strings that hold a banned word, with plain words instead."""
    return [
        f"line {number}: {line.strip()} (plain: {plain})"
        for number, line in _prose(source)
        for pattern, plain in BANNED.items()
        if re.search(pattern, line, re.IGNORECASE)
    ]


def test_the_search_finds_words_in_prose_and_not_in_code() -> None:
    assert len(banned("# the rest is nought")) == 1
    assert len(banned('x = "mend the row"')) == 1
    assert banned("told = ask_for(beside)") == []
    assert banned("# a plain sentence: it is no longer used, because the file was replaced") == []


def test_plain_english() -> None:
    names = {path.relative_to(PACKAGE).as_posix(): path for path in sorted(PACKAGE.rglob("*.py"))}
    found = {
        name: lines
        for name, path in names.items()
        if not name.startswith(OPEN) and (lines := banned(path.read_text(encoding="utf-8")))
    }
    assert found == {}
