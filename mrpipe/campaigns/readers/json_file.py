"""JSON: a mapping of names to lists of numbers, a list of mappings, or the rows of one table."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, flatten
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    content = json.loads(path.read_text(encoding="utf-8-sig"))
    if isinstance(content, list) and content and isinstance(content[0], list):
        return _table(path, content)
    if isinstance(content, list) and content and isinstance(content[0], Mapping):
        content = {key: [row.get(key) for row in content] for key in content[0]}
    if not isinstance(content, Mapping):
        raise UserError(path, "", "holds no named columns", 'write {"t": [...], "x": [...]}')
    leaves = flatten(content)
    return DataFile(path=path, names=tuple(leaves), fetch=lambda name: _values(leaves[name]))


def _values(leaf: Any) -> Any:
    """Return a list as an array, with NaN for null; other leaves as they are."""
    if not isinstance(leaf, list):
        return leaf
    rows = {len(item) if isinstance(item, list) else -1 for item in leaf}
    if len(rows) > 1:
        raise ValueError("its rows differ in length")
    return np.asarray([np.nan if item is None else item for item in leaf])


def _table(path: Path, rows: list[Any]) -> DataFile:
    """Return a list of rows as columns that are called by position, as those of a text file without a header."""
    width = len(rows[0])
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, list) or len(row) != width:
            size = f"{len(row)} values" if isinstance(row, list) else "no list"
            raise UserError(path, f"row {number}", f"has {size}, the first row {width}", "give rows of one length")
    names = tuple(str(index) for index in range(width))
    return DataFile(path, names, lambda name: _values([row[int(name)] for row in rows]), table=True)


READER = Reader((".json",), _read)
