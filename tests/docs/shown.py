"""The command lines that the documentation shows: those in code blocks and those within sentences."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GENERATED = {"command-line.md", "configuration.md"}
"""Pages that a program writes; tests compare them with what it writes."""

_CALL = re.compile(r"^(?:\$ )?(?:\S*/)?mrpipe\s+(.+)$")
_ENDS = {"|", "||", "&&", ";", ">", ">>", "<", "2>", "&"}


@dataclass(frozen=True)
class Shown:
    """A command line of a page.

    Attributes
    ----------
    page
        Path from the root of the project.
    words
        What follows `mrpipe`.
    """

    page: str
    words: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.page}: mrpipe {' '.join(self.words)}"


def pages() -> list[Path]:
    """Return all pages that people write: Markdown and notebooks."""
    found = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "docs").rglob("*.ipynb")]
    return sorted(page for page in found if page.name not in GENERATED)


def shown(page: Path) -> Iterator[Shown]:
    """Yield every call of mrpipe that a page shows."""
    text = re.sub(r" *\\\n\s*", " ", page.read_text(encoding="utf-8"))
    text = re.sub(r"\$\(\(.*?\)\)", "7", text)  # arithmetic of a shell
    name = page.relative_to(ROOT).as_posix()
    blocks = re.findall(r"^```(?:bash|console|sh)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines()]
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    lines += [line[4:] for line in prose.splitlines() if line.startswith("    ")]
    lines += [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", prose)]
    for line in lines:
        for part in line.split("&&"):
            found = _CALL.match(part.strip())
            if found:
                yield Shown(name, tuple(_words(found[1])))


def _words(call: str) -> Iterator[str]:
    """Yield the words of a call, without its comment and what a shell does with its output."""
    for word in shlex.split(call, comments=True):
        if word in _ENDS:
            return
        yield word
