"""Excel workbooks (.xlsx): the sheet with the most rows, and every other sheet with a table as `sheet!column`."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, optional, require_size
from mrpipe.campaigns.schema import TextEntry
from mrpipe.campaigns.tables import table_of_text
from mrpipe.errors import UserError

SEPARATOR = "!"
"""Sign between a sheet and a column, as in Excel's own references."""

FEWEST_ROWS = 40
"""A further sheet with fewer rows is not a record of a test."""


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    openpyxl = optional("openpyxl", "openpyxl", "excel", path)
    with zipfile.ZipFile(path) as archive:
        require_size(path, sum(item.file_size for item in archive.infolist()), path.stat().st_size)
    workbook = openpyxl.load_workbook(path, read_only=True, data_only=True)
    try:
        sheets = {str(sheet.title): list(sheet.iter_rows(values_only=True)) for sheet in workbook.worksheets}
    finally:
        workbook.close()
    if not any(sheets.values()):
        raise UserError(path, "", "holds no row of numbers", "fill one sheet with a header and rows of numbers")
    longest = max(sheets, key=lambda title: len(sheets[title]))
    main = _table(path, sheets[longest])
    others = {title: _record(path, rows) for title, rows in sheets.items() if title != longest}
    return _together(longest, main, others)


def _table(path: Path, rows: list[tuple[Any, ...]]) -> DataFile:
    text = "\n".join("\t".join(_cell(value) for value in row) for row in rows)
    return table_of_text(path, text, TextEntry(delimiter="\t"))


def _record(path: Path, rows: list[tuple[Any, ...]]) -> DataFile | None:
    """Return the table of a further sheet; None where it is too short for a record, or holds no table."""
    if len(rows) < FEWEST_ROWS:
        return None
    try:
        return _table(path, rows)
    except UserError:
        return None  # notes or a figure; only the sheet with the most rows has to be a table


def _together(longest: str, main: DataFile, tables: Mapping[str, DataFile | None]) -> DataFile:
    """Return the columns of all sheets as `sheet!column`; a plain name is that of the sheet with the most rows."""
    others = {title: table for title, table in tables.items() if table is not None}
    if not others:
        return main
    # the main sheet comes first, so that positions count its columns
    found = {longest: main, **others}
    places = {_path(title, name): (title, name) for title, table in found.items() for name in table.names}
    aliases = {name: _path(longest, name) for name in main.names}
    units: dict[str, str] = {}
    for title, table in found.items():
        spellings = {alias: _path(title, name) for alias, name in table.aliases.items()}
        aliases |= {_path(title, alias): name for alias, name in spellings.items()}
        aliases |= spellings if title == longest else {}
        for row in table.headers:
            units |= {_path(title, n): word for n, word in zip(table.names, row, strict=False) if word and word != n}
    return DataFile(
        path=main.path,
        names=tuple(places),
        fetch=lambda name: found[places[name][0]].fetch(places[name][1]),
        table=True,
        first_row=main.first_row,
        row_lines=main.row_lines,
        aliases=aliases,
        units=units,
        separator=SEPARATOR,
    )


def _path(sheet: str, column: str) -> str:
    return f"{sheet}{SEPARATOR}{column}"


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    return " ".join(str(value).split())


READER = Reader((".xlsx", ".xlsm"), _read)
