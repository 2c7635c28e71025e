"""Delimited text as columns: header lines, delimiter, decimal sign, quotes and time stamps are found by themselves."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.artifacts.yaml_source import shown
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.logger import read_logger
from mrpipe.campaigns.schema import TextEntry
from mrpipe.campaigns.stamps import is_stamp, seconds_of
from mrpipe.errors import UserError

_NUMBER = re.compile(r"^[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?$|^[+-]?(nan|inf(inity)?)$", re.IGNORECASE)
_THOUSANDS = re.compile(r"^[+-]?\d{1,3}(?:[.,'\u00a0\u202f ]\d{3})+(?:[.,]\d+)?$")
_DECIMAL_COMMA = re.compile(r"^[+-]?\d*,\d+([eE][+-]?\d+)?$")
_DOTTED_THOUSANDS = r"[+-]?\d{1,3}(?:\.\d{3})+"
MOST_ROWS_LOOKED_AT = 1000
"""Rows in which the decimal sign is looked for."""

_LABELS = {"name", "names", "channel", "channels", "signal", "signals"}


def table_of_text(path: Path, text: str, layout: TextEntry | None = None) -> DataFile:
    """Return the columns of delimited text; what `layout` does not give is found.

    A header is any line above the first row of numbers that has as many fields as it, or one more (a column of
    comments). Where several lines have, each of their words names its column; a line of numbers, such as that of the
    identifiers which dSPACE writes, names none. Without a header, columns are called by position from 0. An empty
    column after a trailing delimiter is left out. Time stamps become seconds from the first one.

    Raises
    ------
    UserError
        If the text holds no row of numbers, or if its first sample is not a number in some column.
    """
    layout = layout or TextEntry()
    lines = text.replace("\u2212", "-").splitlines()  # a minus sign of typesetters
    if not text.strip():
        raise UserError(path, "", "is empty", "export the measurement again, or name another file")
    if lines and lines[0].lower().startswith("header size"):
        return read_logger(path, lines)
    comment = layout.comment or "%#"
    first, delimiter, decimal = _first_row(path, lines, layout, comment)
    fields = _split(lines[first], delimiter)
    headers = _headers(lines[layout.skip_lines : first], delimiter, comment, fields)
    _refuse_damaged_samples(path, lines[:first], delimiter, headers)
    width = max([len(fields), *(len(row) for row in headers)])
    rows = [index for index in range(first, len(lines)) if lines[index].strip() and lines[index][0] not in comment]
    frame = _rows(path, [lines[index] for index in rows], rows, delimiter, decimal, width)
    if _labelled(fields):
        frame.iloc[0, 0] = np.nan
    named = any(len(row) == width and row[-1] for row in headers)
    keep = list(range(width if named or not frame[width - 1].isna().all() else width - 1))
    names = _names(headers, keep)
    aliases = {word: names[index] for row in headers for index, word in enumerate(row) if word and index < len(names)}
    positions = dict(zip(names, keep, strict=True))
    numbers = tuple(index + 1 for index in rows)
    return DataFile(
        path=path,
        names=tuple(names),
        fetch=lambda name: _numbers(path, frame[positions[name]], name, numbers, decimal),
        table=True,
        first_row=first + 1,
        row_lines=numbers if rows[-1] - first + 1 > len(rows) else (),
        aliases={word: name for word, name in aliases.items() if word not in names},
        headers=tuple(tuple(row) for row in headers),
    )


def _rows(
    path: Path, lines: list[str], places: list[int], delimiter: str | None, decimal: str, width: int
) -> pd.DataFrame:
    """Return the rows of numbers; a row with too many fields is reported with its line (`places` count from 0)."""
    try:
        return pd.read_csv(
            io.StringIO("\n".join(lines)),
            sep=delimiter or r"\s+",
            decimal=decimal,
            header=None,
            names=list(range(width)),
            index_col=False,
            skipinitialspace=True,
            dtype=None,
            low_memory=False,
            na_values=[],
        )
    except pd.errors.ParserError:
        for place, line in zip(places, lines, strict=True):
            fields = _split(line.strip() if delimiter is None else line, delimiter)
            if len(fields) > width:
                problem = f"has {len(fields)} fields, the rows above have {width}"
                raise UserError(path, f"line {place + 1}", problem, "correct the row") from None
        raise


def _headers(lines: list[str], delimiter: str | None, comment: str, fields: list[str]) -> list[list[str]]:
    """Return the lines above the first row that name columns, the most telling one first."""
    width = len(fields)
    rows = [_split(line.lstrip(comment).strip("\r\n"), delimiter) for line in lines if line.strip()]
    rows = [[word.strip().strip("\"'") for word in row] for row in rows]
    rows = [row for row in rows if len(row) in (width, width + 1) or (len(row) == width - 1 and fields[-1] == "")]
    rows = [row for row in rows if len(row) <= width or not row[-1] or not _NUMBER.match(row[-1])]
    rows = [row for row in rows if not _is_numeric(row[1:] if len(row) > 1 else row)]
    # a line of units below the names comes later in the order anyway; a line labelled "name" comes first
    return sorted(rows, key=lambda row: row[0].lower() not in _LABELS)


def _refuse_damaged_samples(path: Path, lines: list[str], delimiter: str | None, headers: list[list[str]]) -> None:
    """Raise for a sample above the first row of numbers, such as `0.001, OVL, 2.5`, which would pass for a header.

    It begins with a number, most of its fields are numbers, and a line above it names the columns.
    """
    for row in headers[1:]:
        filled = [item for item in row if item]
        words = [item for item in filled if not (_NUMBER.match(item) or is_stamp(item))]
        if not filled or filled[0] != row[0] or row[0] in words or 2 * len(words) >= len(filled):
            continue
        name = headers[0][row.index(words[0])] if len(headers[0]) == len(row) else str(row.index(words[0]))
        place = next(index for index, line in enumerate(lines) if words[0] in _split(line, delimiter))
        where = f"line {place + 1}, column {name}"
        raise UserError(path, where, f"{shown(words[0])} is not a number", "delete the row, or write a number")


def _split(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    if '"' in line:
        return [item.strip() for item in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
    return [item.strip() for item in line.split(delimiter)]


def _is_numeric(fields: list[str]) -> bool:
    """Whether every field is a number, a time stamp or empty, with a number among them."""
    filled = [item for item in fields if item]
    numbers = [item for item in filled if _NUMBER.match(item)]
    return bool(numbers) and all(_NUMBER.match(item) or is_stamp(item) for item in filled)


def _labelled(fields: list[str]) -> bool:
    """Whether a row of numbers begins with a word, as the first one that dSPACE writes (`trace_values`)."""
    return bool(fields[0]) and not _NUMBER.match(fields[0]) and not is_stamp(fields[0])


def _first_row(path: Path, lines: list[str], layout: TextEntry, comment: str) -> tuple[int, str | None, str]:
    """Return the index of the first row of numbers, the delimiter (None: white space) and the decimal sign."""
    candidates: list[str | None] = [layout.delimiter] if layout.delimiter else ["\t", ";", ",", None]
    for index in range(layout.skip_lines, min(len(lines), layout.skip_lines + 200)):
        line = lines[index].strip("\r\n")
        if not line.strip() or line[0] in comment:
            continue
        for delimiter in candidates:
            fields = _split(line.strip() if delimiter is None else line, delimiter)
            if delimiter is not None and delimiter not in line:
                continue
            rows = _is_numeric(fields) or _begins_with_label(fields, lines[index + 1 : index + 2], delimiter)
            if rows and (delimiter is None or len(fields) > 1):
                return index, delimiter, layout.decimal or _decimal(fields, lines[index + 1 :], delimiter)
    _refuse_thousands(path, lines, layout)
    raise UserError(path, "", "holds no row of numbers", "name a delimited text, or give text: {skip_lines, delimiter}")


def _refuse_thousands(path: Path, lines: list[str], layout: TextEntry) -> None:
    """Raise for the first row of numbers with separators of thousands."""
    for index in range(layout.skip_lines, min(len(lines), layout.skip_lines + 200)):
        # where the comma is the delimiter, only quotes keep a number with separators together
        comma = [","] if '"' in lines[index] else []
        for delimiter in [layout.delimiter] if layout.delimiter else ["\t", ";", *comma]:
            fields = [item for item in _split(lines[index].strip("\r\n"), delimiter) if item]
            grouped = [item for item in fields if _THOUSANDS.match(item) and not _NUMBER.match(item)]
            known = [item for item in fields if item in grouped or _NUMBER.match(item) or is_stamp(item)]
            if len(fields) > 1 and grouped and len(known) == len(fields):
                decimal = "," if re.search(r",\d*$", grouped[0]) else "."
                remedy = _remedy(grouped[0], np.array([True]), decimal)
                raise UserError(path, f"line {index + 1}", f"{grouped[0]!r} is not a number", remedy)


def _decimal(fields: list[str], following: list[str], delimiter: str | None) -> str:
    """Return the decimal sign; the first row may be one of whole numbers, so that later ones show it.

    Where the comma is the delimiter too, a comma in quotes of a later row may separate thousands.
    """
    if any("," in item for item in fields if _NUMBER.match(item)):
        return ","
    for line in following[:MOST_ROWS_LOOKED_AT] if delimiter != "," else ():
        numbers = [item for item in _split(line.strip("\r\n"), delimiter) if _NUMBER.match(item)]
        if any("," in item or "." in item for item in numbers):
            return "," if any("," in item for item in numbers) else "."
    return "."


def _begins_with_label(fields: list[str], following: list[str], delimiter: str | None) -> bool:
    """Whether a row is a label and numbers, and the next one the same without the label."""
    if delimiter is None or len(fields) < 2 or not following or not _is_numeric(fields[1:]):
        return False
    below = _split(following[0], delimiter)
    return len(below) == len(fields) and below[0] == "" and _is_numeric(below)


def _names(headers: list[list[str]], keep: list[int]) -> list[str]:
    """Return one name a column: the first header line that has one, else the position."""
    names: list[str] = []
    for index in keep:
        words = [row[index] for row in headers if index < len(row) and row[index]]
        name = words[0] if words else str(index)
        names.append(name if name not in names else f"{name}#{index}")
    return names


def _numbers(path: Path, column: Any, name: str, lines: tuple[int, ...], decimal: str) -> FloatArray:
    """Return a column as floats; text that is not a time stamp is reported with its line."""
    if column.dtype.kind in "fiub":
        return np.asarray(column, dtype=np.float64)
    filled = column.dropna()
    if len(filled) and all(is_stamp(str(item).strip()) for item in filled.iloc[[0, len(filled) // 2, -1]]):
        return seconds_of(path, column, name, lines)
    numbers = pd.to_numeric(column, errors="coerce")
    if decimal == ",":
        # one word in a column of decimal commas leaves all of it as text
        text = column.astype(str)
        numbers = numbers.fillna(pd.to_numeric(text.str.replace(",", ".", regex=False), errors="coerce"))
        if text.str.contains(",", regex=False).any():
            numbers = numbers.mask(text.str.fullmatch(_DOTTED_THOUSANDS))
    wrong = (numbers.isna() & column.notna()).to_numpy()
    if wrong.any():
        row = int(np.argmax(wrong))
        found = str(column.iloc[row])
        where = f"line {lines[row]}, column {name}"
        remedy = _remedy(found, wrong, decimal)
        if found.strip() == name and remedy == "write a number":
            remedy = "the header stands here again, as if the recording had been started again: make two files of it"
        raise UserError(path, where, f"{shown(found)} is not a number", remedy)
    return np.asarray(numbers, dtype=np.float64)


def _remedy(found: str, wrong: BoolArray, decimal: str) -> str:
    """Return what to do about the first of some fields that are not numbers."""
    if decimal == "." and _DECIMAL_COMMA.match(found):
        other = "write numbers without separators of thousands, or " if _THOUSANDS.match(found) else ""
        return f"{other}for decimal commas give text: {{decimal: ','}} in campaign.yaml"
    if _THOUSANDS.match(found):
        whole, _, part = re.split(r"([.,])(?=\d*$)", found) if {".", ","} <= set(found) else ("", "", "")
        example = f", as {re.sub('[^0-9+-]', '', whole)}{decimal}{part}" if part else ""
        return f"write numbers without separators of thousands{example}"
    last = np.flatnonzero(~wrong)[-1:]
    if last.size and wrong[last[0] + 1 :].all() and wrong.sum() == wrong.size - last[0] - 1 and not found[:1].isdigit():
        return "delete the lines after the last sample"
    return "write a number"
