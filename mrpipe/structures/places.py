"""Degrees of freedom that settings name: by name, by number from 1, or the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.structures.frame import Frame

GROUND = ("ground", "0")
"""Names of the ground."""


def place_among(names: Sequence[str], name: str | int, where: str = "structure") -> int:
    """Return the index (from 0) of a degree of freedom given by its name or its number (from 1).

    Parameters
    ----------
    names
        Names of all degrees of freedom.
    name
        Name or number.
    where
        Setting that gives it, for the message.

    Raises
    ------
    UserError
        If no such degree of freedom exists.
    """
    text = str(name)
    if text in names:
        return list(names).index(text)
    if text.isdigit() and 1 <= int(text) <= len(names):
        return int(text) - 1
    remedy = f"1 to {len(names)}, or one of {', '.join(names[:12])}"
    raise UserError(where, "", f"{text!r} is not a degree of freedom", remedy)


def degree_of_freedom(frame: Frame, name: str | int, where: str = "structure") -> int:
    """Return the index (from 0) of a degree of freedom of a frame, as :func:`place_among`."""
    return place_among(frame.names, name, where)


def ends_among(
    names: Sequence[str], first: str | int, second: str | int = "ground", where: str = "structure"
) -> tuple[int, int | None]:
    """Return the indices (from 0) of the two ends of a device; the second one is None for the ground.

    Parameters
    ----------
    names
        Names of all degrees of freedom.
    first, second
        The two ends, by name or number; one of them may be the ground.
    where
        Setting that gives them, for the message.

    Raises
    ------
    UserError
        If a degree of freedom is unknown, or both ends are the same.
    """
    if str(first) in GROUND and str(second) in GROUND:
        raise UserError(where, f"{first} to {second}", "connects the ground to itself", "give a degree of freedom")
    if str(first) in GROUND:
        first, second = second, first
    one = place_among(names, first, where)
    other = None if str(second) in GROUND else place_among(names, second, where)
    if one == other:
        raise UserError(
            where, f"{first} to {second}", "connects a degree of freedom to itself", "give two different ones"
        )
    return one, other


def device_position(
    frame: Frame, first: str | int, second: str | int = "ground", where: str = "structure"
) -> FloatArray:
    """Return the connectivity vector w, shape (n,), of a device between two degrees of freedom, or one and ground.

    The displacement of the device is w'x = x_first - x_second; the first or the second may be the ground.

    Raises
    ------
    UserError
        If a degree of freedom is unknown, or both ends are the same.
    """
    one, other = ends_among(frame.names, first, second, where)
    w = np.zeros(frame.floors)
    w[one] = 1.0
    if other is not None:
        w[other] = -1.0
    return w
