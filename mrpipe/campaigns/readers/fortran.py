"""Rows of numbers as Fortran programs write them: in columns of fixed width, with D exponents, or run together."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from mrpipe.errors import UserError

_D_EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[-+]?\d)")
_LONG_EXPONENT = re.compile(r"(?<=\d|\.)(?=[-+]\d{3}(?![\d.]))")
"""Fortran leaves the E out where the exponent has three digits: 0.1234567-101."""
_BEFORE_A_SIGN = re.compile(r"(?<=[\d.])(?=[-+])")


def row_of_numbers(line: str, width: int | None = None) -> list[float] | None:
    """Return the numbers of a line, None where it is not a row of numbers.

    Numbers between blanks or commas are taken as they stand. Where they run together (`0.0000295-0.0000208`), the
    columns divide them, or without a width their signs.

    Parameters
    ----------
    line
        Without or with its end; a line of blanks is a row of no numbers.
    width
        Columns of one number where the file states them (10 for the format 8F10.3).
    """
    text = _D_EXPONENT.sub("E", line.rstrip().replace(",", " "))
    words = text.split()
    separate = None if width is not None and any(len(word) > width for word in words) else _floats(words)
    if separate is not None:
        return separate
    if width is not None:
        return _floats(text[start : start + width] for start in range(0, len(text), width))
    return _floats(_BEFORE_A_SIGN.sub(" ", _LONG_EXPONENT.sub("E", text)).split())


def required_row(
    path: Path, number: int, line: str, width: int | None = None, *, remedy: str = "download the record again"
) -> list[float]:
    """Return the numbers of a line as :func:`row_of_numbers` does.

    Parameters
    ----------
    path, number
        The file, and the number of the line from 1, for the message.
    line, width
        See :func:`row_of_numbers`.
    remedy
        Remedy that the message advises.

    Raises
    ------
    UserError
        If the line is not a row of numbers.
    """
    row = row_of_numbers(line, width)
    if row is None:
        problem = f"is not a row of numbers ({line.strip()[:30]!r})"
        raise UserError(path, f"line {number}", problem, remedy)
    return row


def _floats(pieces: Iterable[str]) -> list[float] | None:
    try:
        return [float(piece) for piece in pieces if piece.strip()]
    except ValueError:
        return None
