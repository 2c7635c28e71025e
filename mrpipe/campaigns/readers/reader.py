"""The contract of a reader of data files, and the limits that all readers keep."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError, install_extra

LOADS_FROM: tuple[str, ...] = ()
"""Only packages of other makers are imported by name here, none of mrpipe."""

LARGEST_BYTES = 4 * 2**30
"""Largest size of a file or channel in memory; what claims more is refused before it is read."""

MOST_EXPANSION = 300
"""Largest ratio of unpacked to packed bytes of files above 256 MiB; measurements do not shrink that much."""


MOST_MAPPINGS = 500
"""Longest list of mappings that is read as channels; a longer one holds rows."""


@dataclass(frozen=True)
class Reader:
    """Reader of files with certain endings.

    Attributes
    ----------
    endings
        Lower-case endings with their dot.
    read
        Path and layout of delimited text -> columns. May raise anything: the caller turns it into one line.
    """

    endings: tuple[str, ...]
    read: Callable[[Path, TextEntry | None], DataFile]


def optional(module: str, package: str, extra: str, path: Path) -> ModuleType:
    """Import a package of an optional extra.

    Raises
    ------
    UserError
        If it is not installed; the message names the extra.
    """
    try:
        return import_module(module)
    except ImportError:
        kind = path.suffix or "such"
        problem = f"{kind} files need the package {package}, which is not installed"
        raise UserError(path, "", problem, install_extra(extra)) from None


def require_size(path: Path, claimed: int, stored: int) -> None:
    """Refuse data that claim more memory than plausible for what is stored.

    Raises
    ------
    UserError
        Naming the sizes.
    """
    suspicious = claimed > 2**28 and claimed > MOST_EXPANSION * max(stored, 1)
    if claimed > LARGEST_BYTES or suspicious:
        raise UserError(
            path,
            "",
            f"claims {claimed / 2**30:.3g} GiB of data, but stores {stored / 2**20:.3g} MiB",
            "export the measurement again, or split it into several files",
        )


def flatten(content: Mapping[str, Any], prefix: str = "", depth: int = 0) -> dict[str, Any]:
    """Return dotted name -> leaf of nested mappings.

    Of a list of mappings, each one is called by its `Name`, where all have `Name` and `Data` (as ControlDesk writes
    the channels of a record), else by its number from 1.

    Raises
    ------
    ValueError
        If the nesting is deeper than 40 levels.
    """
    if depth > 40:
        raise ValueError("nested too deeply")
    leaves: dict[str, Any] = {}
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            leaves.update(flatten(value, f"{name}.", depth + 1))
        elif isinstance(value, list | np.ndarray) and len(items := _mappings(value)):
            leaves.update(flatten(items, f"{name}.", depth + 1))
        else:
            leaves[name] = value
    return leaves


def _mappings(values: Any) -> dict[str, Any]:
    """Return the mappings of a list by name or number; empty where it holds anything else."""
    if (
        getattr(values, "ndim", 1) != 1
        or not 0 < len(values) <= MOST_MAPPINGS
        or not all(isinstance(item, Mapping) for item in values)
    ):
        return {}
    if all({"Name", "Data"} <= set(item) for item in values):
        named = {str(item["Name"]).strip("\"' "): item["Data"] for item in values}
        if len(named) == len(values):
            return named
    return {str(index): item for index, item in enumerate(values, start=1)}


def short_names(names: list[str], separator: str) -> dict[str, str]:
    """Return the last part of each path-like name -> the name, where that part is unique."""
    last = [name.rpartition(separator)[2] for name in names]
    return {part: name for part, name in zip(last, names, strict=True) if last.count(part) == 1 and part != name}


def constant_rate(time: np.ndarray) -> float | None:
    """Return the sampling rate [Hz] of an even clock, None where it is uneven or too short."""
    if time.size < 2:
        return None
    steps = np.diff(time)
    step = float(np.median(steps))
    even = step > 0.0 and float(np.max(np.abs(steps - step))) < 1e-3 * step
    return 1.0 / step if even else None
