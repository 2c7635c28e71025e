"""Parquet files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, optional, require_size
from mrpipe.campaigns.schema import TextEntry


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    """Return the columns; time stamps become seconds from the first one."""
    parquet = optional("pyarrow.parquet", "pyarrow", "parquet", path)
    with parquet.ParquetFile(str(path)) as file:
        rows = int(file.metadata.num_rows)
        names = [str(name) for name in file.schema_arrow.names]
    require_size(path, rows * 8, path.stat().st_size)

    def fetch(name: str) -> Any:
        values = parquet.read_table(str(path), columns=[name]).column(0).to_numpy()
        if values.dtype.kind == "M":
            return (values - values[0]) / np.timedelta64(1, "s")
        return values

    return DataFile(path=path, names=tuple(names), fetch=fetch, table=True)


READER = Reader((".parquet", ".pq"), _read)
