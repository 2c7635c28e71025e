"""Where the degrees of freedom of a structure are, as far as their names tell: floors and directions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from mrpipe.words import counted

_FLOOR = re.compile(r"^floor (\d+)(?: (\S+))?$")
_MODE = re.compile(r"^mode \d+$")
ROTATION = "rotation"


def names_of(summary: Mapping[str, Any]) -> list[str]:
    """Return the names of the degrees of freedom of an identified or given structure; without names, its floors."""
    return list(summary.get("degrees_of_freedom") or floor_names(len(summary["mode_shapes"])))


def floor_names(count: int) -> list[str]:
    """Return the names of the floors of a frame in one direction."""
    return [f"floor {floor}" for floor in range(1, count + 1)]


def by_direction(names: Sequence[str]) -> dict[str, dict[int, int]] | None:
    """Return floor -> row of the shapes for each direction; None where the names are not those of floors.

    Amplitudes of modes, as a reduced structure has them, are at no place and are left out.

    Parameters
    ----------
    names
        Names of the degrees of freedom: `floor 3`, or with several directions `floor 3 x` and `floor 3 rotation`.
    """
    found: dict[str, dict[int, int]] = {}
    for row, name in enumerate(names):
        if _MODE.match(name):
            continue
        said = _FLOOR.match(name)
        if said is None or int(said[1]) in found.setdefault(said[2] or "", {}):
            return None
        found[said[2] or ""][int(said[1])] = row
    return found or None


def is_chain(names: Sequence[str]) -> bool:
    """Return whether the degrees of freedom are all floors of a frame in one direction, from the lowest to the top."""
    found = by_direction(names)
    floors = None if found is None else found.get("")
    return floors is not None and list(floors) == list(range(1, len(names) + 1))


def size_in_words(names: Sequence[str]) -> str:
    """Return how large a structure is, such as `5 floors` or `2 floors with 6 degrees of freedom`."""
    found = by_direction(names)
    freedoms = f"{counted(len(names), 'degree')} of freedom"
    if found is None:
        return freedoms
    floors = sorted({floor for places in found.values() for floor in places})
    count = counted(len(floors), "floor")
    if is_chain(names):
        return count
    # floors may be missing, as after a reduction
    return f"{count} with {freedoms}" if floors == list(range(1, len(floors) + 1)) else freedoms
