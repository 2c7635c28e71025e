"""Units of the matrices and the storey table that a user gives."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from mrpipe.errors import UserError
from mrpipe.structures.options import StoreyColumn, StructureSettings
from mrpipe.units import bracketed_units, conversion
from mrpipe.words import listed

SI = {"mass": "kg", "stiffness": "N/m", "damping": "N*s/m", "height": "m"}
"""Unit that is taken where the user states none."""


def unit_of_column(column: StoreyColumn, where: str) -> str:
    """Return the unit of a column, which its name may end with in brackets; empty if neither states it."""
    found = [] if column.values else bracketed_units(column.name)
    named = found[-1].unit if found and not column.name[found[-1].end :].strip() else ""
    if column.unit and named and not math.isclose(conversion(column.unit, where=f"{where}.unit"), conversion(named)):
        problem = f"is {column.unit}, and the column is called {column.name!r}"
        raise UserError(where, "unit", problem, f"give {named}, or correct the name of the column")
    return column.unit or named


def input_units(settings: StructureSettings) -> dict[str, dict[str, Any]]:
    """Return quantity -> `unit`, and whether it is `assumed` because the user states none.

    It is empty for a structure whose settings have their units in the names of the keys.
    """
    table = settings.storey_table
    stated: dict[str, str] = {}
    if table.given:
        columns = {"mass": table.mass, "stiffness": table.stiffness, "height": table.height}
        stated = {
            key: unit_of_column(column, f"structure.storey_table.{key}")
            for key, column in columns.items()
            if column.name or column.values
        }
    elif settings.file or settings.mass.file or settings.stiffness.file:
        stated = {"mass": settings.mass.unit, "stiffness": settings.stiffness.unit}
        if settings.damping.name or settings.damping.file:
            stated["damping"] = settings.damping.unit
    return {key: {"unit": unit or SI[key], "assumed": not unit} for key, unit in stated.items()}


def warn_of_assumed_units(settings: StructureSettings, warn: Callable[[str], None] | None) -> None:
    """Warn where a matrix or a column has no unit, so that SI is taken.

    Parameters
    ----------
    settings
        Section `structure`.
    warn
        Function that is called with the warning.
    """
    assumed = {key: item["unit"] for key, item in input_units(settings).items() if item["assumed"]}
    if not assumed or warn is None:
        return
    section = "structure.storey_table" if settings.storey_table.given else "structure"
    taken = listed([f"the {key} is taken in {unit}" for key, unit in assumed.items()])
    keys = listed([f"{section}.{key}.unit" for key in assumed])
    given = "is not given" if len(assumed) == 1 else "are not given"
    warn(f"{taken}, because {keys} {given}")
