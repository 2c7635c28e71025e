"""Words of messages and reports: lists, counts and times as people write them."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path


def listed(names: Sequence[str]) -> str:
    """Return `a`, `a and b`, `a, b and c`; empty without names."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def some(names: Sequence[str]) -> str:
    """Return the first three names, with dots where there are more: `a, b, c, ...`."""
    return ", ".join([*names[:3], *(["..."] if names[3:] else [])])


def shell_word(text: str | Path) -> str:
    """Return a path or value as one word of a command that can be copied into a shell."""
    return shlex.quote(str(text))


def noun(count: int, word: str) -> str:
    """Return a regular noun in the number that a count requires: `test` for 1, else `tests`."""
    return word if count == 1 else f"{word}s"


def counted(count: int, word: str) -> str:
    """Return a count with its regular noun: `1 test`, `3 tests`."""
    return f"{count} {noun(count, word)}"


def duration(seconds: float) -> str:
    """Return a time in a readable unit: 45 s, 12 min, 3.2 h."""
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def in_percent(ratio: float, decimals: int = 0, *, signed: bool = False) -> str:
    """Return a ratio in percent, with a space before the sign as SI requires.

    Parameters
    ----------
    ratio
        The ratio [1].
    decimals
        Number of decimals.
    signed
        Whether a positive number has a plus sign.
    """
    return f"{100.0 * ratio:{'+' if signed else ''}.{decimals}f} %"
