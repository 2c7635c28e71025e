"""Package, pages and configurations are in plain technical English: words of a private style do not come back."""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.property

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "mrpipe"

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
    r"(?<!there )\b(is|are|was|were) no (?!(longer|less|more|\w+er|worse)\b)": "is not a",
    r"\b(stands?|stood|standing) out\b": "exceeds the noise, is significant, dominates",
    r"\bstands? for no\b": "has no",
    r"\bruns? straight\b": "is linear",
    r"\bturn(s|ed)? round\b": "reverses",
    r"\blays? out\b": "creates",
    r"\b(structure|frame) folds\b": "is statically unstable",
    r"\bgo(es)? by\b": "depends on, is relative to",
    r"\b(has|have) no order\b": "are not ranked",
    r"\bnext to nothing\b": "very little",
    r"\b(but for|besides)\b": "except for, in addition to",
    r"\bwhat is said of\b": "summary, row",
    r"\bsays? nothing\b": "carries no information, does not show",
    r"\bleaves? it open\b": "does not give",
    r"\bdoes no harm\b": "does not matter",
    r"\bin vain\b": "without effect",
    r"\bby other hands\b": "outside mrpipe",
    r"\bnothing to work on\b": "needs",
    r"\b(spares|spared) (all|the others)\b": "none is built",
    r"\bof which neither\b": "that neither of them",
    r"\bfor (twice|half) the time\b": "doubles the run time",
    r"\b(only|cut off) so much\b": "this multiple, this length",
    r"\bcome to from\b": "reached from",
    r"\bsealed beside\b": "stored in",
    r"\bexplains what any\b": "explains as much as",
    r"\btells nothing\b": "carries no information",
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


def _pages() -> dict[str, str]:
    """Return the pages that people write, and the configurations: name -> text."""
    found = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.ipynb")]
    found += [*(ROOT / "configs").rglob("*.yaml"), ROOT / "Makefile", *(ROOT / "mrpipe").rglob("*.html")]
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in sorted(found)}


def test_pages_and_configurations() -> None:
    found = {
        f"{name}, line {number}": f"{line.strip()[:120]} (plain: {plain})"
        for name, text in _pages().items()
        for number, line in enumerate(text.splitlines(), 1)
        for pattern, plain in BANNED.items()
        if re.search(pattern, line, re.IGNORECASE)
    }
    assert len(_pages()) > 50
    assert found == {}


def test_the_search_finds_words_in_prose_and_not_in_code() -> None:
    assert len(banned("# the rest is nought")) == 1
    assert len(banned('x = "mend the row"')) == 1
    assert banned("told = ask_for(beside)") == []
    assert banned("# a plain sentence: it is no longer used, because the file was replaced") == []


def test_plain_english() -> None:
    names = {path.relative_to(PACKAGE).as_posix(): path for path in sorted(PACKAGE.rglob("*.py"))}
    found = {name: lines for name, path in names.items() if (lines := banned(path.read_text(encoding="utf-8")))}
    assert found == {}
