"""Excel workbooks (.xlsx): the sheet with the most rows."""

from __future__ import annotations

import zipfile
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, optional, require_size
from mrpipe.campaigns.schema import TextEntry
from mrpipe.campaigns.tables import table_of_text
from mrpipe.errors import UserError


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    openpyxl = optional("openpyxl", "openpyxl", "excel", path)
    with zipfile.ZipFile(path) as archive:
        require_size(path, sum(item.file_size for item in archive.infolist()), path.stat().st_size)
    workbook = openpyxl.load_workbook(path, read_only=True, data_only=True)
    try:
        sheets = [list(sheet.iter_rows(values_only=True)) for sheet in workbook.worksheets]
    finally:
        workbook.close()
    rows = max(sheets, key=len, default=[])
    if not rows:
        raise UserError(path, "", "holds no row of numbers", "fill one sheet with a header and rows of numbers")
    text = "\n".join("\t".join(_cell(value) for value in row) for row in rows)
    return table_of_text(path, text, TextEntry(delimiter="\t"))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    return " ".join(str(value).split())


READER = Reader((".xlsx", ".xlsm"), _read)
