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


@dataclass(frozen=True)
class Reader:
    """How files of some endings are read.

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
        else:
            leaves[name] = value
    return leaves


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
