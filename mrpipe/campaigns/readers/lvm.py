"""LabVIEW measurement files (.lvm), and the same text under another ending."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, constant_rate, optional
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError

FIRST_WORDS = "LabVIEW Measurement"

_BLANK = re.compile(r"^[ \t]+$", re.MULTILINE)


def read_lvm(path: Path, text: str) -> DataFile:
    """Return the channels of all segments of a LabVIEW measurement file, one after the other.

    The text is handed to the library, because reading by name would also load a pickle in the same folder.
    """
    lvm_read = optional("lvm_read", "lvm-read", "labview", path)
    # a spreadsheet saves the empty line before a segment with a tab for each column, which the library does not take
    content = lvm_read.read_str(_BLANK.sub("", text))
    segments = [content[index] for index in range(content["Segments"])]
    names = [str(name).strip() for name in segments[0]["Channel names"]]
    if any([str(name).strip() for name in item["Channel names"]] != names for item in segments):
        raise UserError(path, "", "its segments hold different channels", "export each segment to its own file")
    values = np.vstack([item["data"][:, : len(names)] for item in segments])
    keep = [index for index, name in enumerate(names) if name != "Comment" and np.isfinite(values[:, index]).any()]
    columns = {names[index] or str(index): values[:, index] for index in keep}
    clock = columns.get("X_Value")
    step = [float(item) for item in np.atleast_1d(segments[0].get("Delta_X", [])) if float(item) > 0.0]
    if clock is None and step:
        clock = step[0] * np.arange(len(values))
    return DataFile(
        path=path,
        names=tuple(columns),
        fetch=columns.__getitem__,
        table=True,
        time_s=clock,
        sampling_rate_hz=None if clock is None else constant_rate(clock),
        units=_units(names, segments[0]),
    )


def _units(names: Sequence[str], segment: Mapping[str, Any]) -> dict[str, str]:
    """Return channel -> unit that the header of a segment states, where one time column stands before the channels."""
    if names[:1] != ["X_Value"] or names.count("X_Value") > 1:
        return {}
    stated = [str(item).strip() for item in segment.get("Y_Unit_Label", [])]
    return {name: unit for name, unit in zip(names[1:], stated, strict=False) if unit and name != "Comment"}


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    from mrpipe.campaigns.readers.text import decode

    text = decode(path)
    if not text.lstrip().startswith(FIRST_WORDS):
        raise UserError(path, "line 1", f"does not begin with {FIRST_WORDS!r}", "name a LabVIEW measurement file")
    return read_lvm(path, text)


READER = Reader((".lvm",), _read)
