"""JSON: a mapping of names to lists of numbers, or a list of mappings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, flatten
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    content = json.loads(path.read_text(encoding="utf-8-sig"))
    if isinstance(content, list) and content and isinstance(content[0], Mapping):
        content = {key: [row.get(key) for row in content] for key in content[0]}
    if not isinstance(content, Mapping):
        raise UserError(path, "", "holds no named columns", 'write {"t": [...], "x": [...]}')
    leaves = {
        name: np.asarray([np.nan if item is None else item for item in value]) if isinstance(value, list) else value
        for name, value in flatten(content).items()
    }
    return DataFile(path=path, names=tuple(leaves), fetch=leaves.__getitem__)


READER = Reader((".json",), _read)
