"""Why a file, or one of its columns, gives no channel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.proposal.columns import FEWEST_SAMPLES, MOST_COLUMNS, Column
from mrpipe.campaigns.proposal.words import read_header
from mrpipe.errors import UserError
from mrpipe.words import counted


def why_no_columns(file: DataFile) -> str:
    """Return why :func:`columns_of` finds less than two columns in a file."""
    rows = max((_rows(file, name) for name in file.names[:MOST_COLUMNS]), default=0)
    if 0 < rows <= FEWEST_SAMPLES:
        return f"has {counted(rows, 'row')} only; a record has more than {FEWEST_SAMPLES}"
    return "fewer than two columns of numbers"


def _rows(file: DataFile, name: str) -> int:
    try:
        return int(np.shape(file.fetch(name))[0])
    except Exception:
        return 0


def unreadable_channels(file: DataFile, columns: Sequence[Column]) -> dict[str, str]:
    """Return why a column is not used, for each one whose header names a channel and whose samples cannot be read.

    Parameters
    ----------
    file
        Data file.
    columns
        Its columns that were read.
    """
    lines = {}
    read = {item.name for item in columns}
    for name in file.names[:MOST_COLUMNS] if file.table else ():
        if name in read:
            continue
        header = read_header(name)
        if not (header.quantity or header.unit_quantity):
            continue
        try:
            file.column(name, "")
        except UserError as error:
            said = f"{error.problem}; {error.remedy}"
            lines[name] = f"{error.where}: {said}" if error.where else said
    return lines
