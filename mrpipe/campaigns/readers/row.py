"""Fields of a row of numbers in a text file, separated by blanks, commas or semicolons."""

from __future__ import annotations

import re

_DECIMAL_COMMA = re.compile(r"^[+-]?\d+,\d+([eE][+-]?\d+)?$")


def fields_of(line: str) -> list[str]:
    """Return the fields of a row, with decimal points instead of decimal commas.

    A comma is a decimal comma in a row with semicolons, and in a row in which every field contains exactly one. In
    other rows it separates fields.
    """
    fields = line.replace(";", " ").split()
    decimal = ";" in line or (len(fields) > 1 and all(_DECIMAL_COMMA.match(field) for field in fields))
    return [field.replace(",", ".") for field in fields] if decimal else line.replace(",", " ").split()
