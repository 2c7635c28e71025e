"""Degrees of freedom that the settings of a structure name are checked before its matrices are computed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrpipe.artifacts import require_parameter_set
from mrpipe.structures.given import Reader, as_many
from mrpipe.structures.options import StructureSettings
from mrpipe.structures.places import ends_among, place_among
from mrpipe.structures.reduction import require_keep
from mrpipe.structures.shear_frames import frame_from_parameter_set


def require_places(settings: StructureSettings, read: Reader) -> tuple[str, ...]:
    """Refuse dampers, accelerometers and places to keep at degrees of freedom that the structure does not have.

    The stage that computes the matrices refuses them too. It also knows degrees of freedom without mass, which it
    removes, and those of a structure that is identified or that an OpenSees script builds.

    Parameters
    ----------
    settings
        Section `structure`.
    read
        Function that reads a variable of a data file.

    Returns
    -------
    Names of the degrees of freedom after the reduction; empty if only the matrices show them.

    Raises
    ------
    UserError
        If a degree of freedom does not exist; the message names the setting.
    """
    count = _count(settings, read)
    lengths = {key: getattr(settings, key) for key in ("degrees_of_freedom", "influence", "influence_y")}
    for key, values in lengths.items():
        if count and values:
            as_many(key, values, count)
    full = settings.degrees_of_freedom or _floors(count)
    if not full:
        return ()
    if settings.reduction.method != "none":
        require_keep(settings.reduction)
    for place, name in enumerate(settings.reduction.keep):
        place_among(full, name, f"structure.reduction.keep[{place}]")
    names = _after_reduction(full, settings)
    for place, damper in enumerate(settings.dampers):
        ends_among(names, *damper.between, where=f"structure.dampers[{place}].between")
    for place, name in enumerate(settings.accelerometers):
        place_among(names, name, f"structure.accelerometers[{place}]")
    return names


def _floors(count: int) -> tuple[str, ...]:
    return tuple(f"floor {place + 1}" for place in range(count))


def _count(settings: StructureSettings, read: Reader) -> int:
    """Return the number of degrees of freedom; 0 if only the matrices show it."""
    table, file = settings.storey_table, settings.mass.file or settings.file
    if settings.mode_shapes:
        return len(settings.mode_shapes)
    if settings.storeys:
        return sum(row.repeat for row in settings.storeys)
    if table.given:
        return len(table.mass.values) or int(np.size(read(Path(table.file), table.mass.name)))
    if settings.frame:
        require_parameter_set("frames", settings.frame, "structure.frame")
        return frame_from_parameter_set(settings.frame).floors
    # an OpenSees script would be run for it
    return 0 if not file or file.endswith(".py") else max(np.shape(read(Path(file), settings.mass.name)), default=1)


def _after_reduction(full: Sequence[str], settings: StructureSettings) -> tuple[str, ...]:
    """Return the names after the reduction."""
    reduction = settings.reduction
    if reduction.method == "none":
        return tuple(full)
    # in the order of the structure, as the reduction has them
    kept = sorted({place_among(full, name) for name in reduction.keep})
    modes = {"craig-bampton": reduction.modes, "balanced": reduction.modes - len(kept)}.get(reduction.method, 0)
    return (*(full[place] for place in kept), *(f"mode {mode + 1}" for mode in range(modes)))
