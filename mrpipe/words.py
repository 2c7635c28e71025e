"""Words of messages and reports: lists, counts and times as people write them."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

HUGE_RATIO = 1e6
"""Ratio from which a percentage has an exponent, because nobody counts so many digits."""


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


def shortest(path: str | Path) -> str:
    """Return a path relative to the working directory where it lies in it, else unchanged: `data/a.csv`.

    The working directory itself is unchanged too, because a point names nothing.
    """
    try:
        here = Path.cwd()
    except FileNotFoundError:  # it was removed
        return str(path)
    within = Path(path).is_relative_to(here) and here not in (Path(path), Path(here.anchor))
    return str(Path(path).relative_to(here)) if within else str(path)


def separating_tests(tests: Sequence[str]) -> str:
    """Return `a test that separates them is ...`, in the number of the proposed tests; empty if there are none."""
    if not tests:
        return ""
    which = "a test that separates them is" if len(tests) == 1 else "tests that separate them are"
    return f"{which} {'; '.join(tests)}"


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


def number(value: Any, digits: int = 3) -> str:
    """Return a number with some significant digits, without exponent where it can be read without; `-` for none."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    # rounded first: 0.9999 with three digits is 1.00, not 1.000
    places = digits - 1 - math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if -6 <= places <= 6:
        return f"{round(value, places):.{max(places, 0)}f}"
    return f"{value:.{digits - 1}e}"


def in_percent(
    ratio: float | None, decimals: int = 0, *, digits: int | None = None, signed: bool = False, exact: bool = False
) -> str:
    """Return a ratio in percent, with a space before the sign as SI requires.

    Parameters
    ----------
    ratio
        The ratio [1]; `-` is returned for None.
    decimals
        Number of decimals.
    digits
        Number of significant digits, in place of a number of decimals; `-` is then returned for a ratio that is not
        finite.
    signed
        Whether a positive number has a plus sign.
    exact
        Whether the ratio was chosen, such as a tolerance, so that zeros at its end do not state its accuracy and are
        left out.
    """
    if ratio is None:
        return "-"
    if digits is not None:
        shown = f"{100.0 * ratio:.{digits}g}" if exact else number(100.0 * ratio, digits)
        return shown if shown == "-" else f"{'+' if signed and ratio > 0.0 else ''}{shown} %"
    sign = "+" if signed else ""
    if abs(ratio) >= HUGE_RATIO:
        return f"{100.0 * ratio:{sign}.2e} %"
    return f"{100.0 * ratio:{sign}.{decimals}f} %"
