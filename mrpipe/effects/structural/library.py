"""All effects of a structure: those of the modules of the package, and those of files that the configuration names."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import mrpipe.effects.structural as package
from mrpipe.effects.contract import Effect
from mrpipe.effects.library import effect_of_file, effects_in
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.errors import UserError

LOADS_FROM = ("mrpipe.effects.structural",)
"""Packages whose modules are found at run time; they are part of the code version of a stage."""

NOT_TRIED = "is an effect of your own on a damper, and the tracing of a structure tries only those of the program"
"""Reason why the tracing of a structure leaves out an effect of `close_loop.effect_files`."""

TRACED_ON_BENCH = "trace it on a bench campaign of the damper, or leave its file out of close_loop.effect_files"
"""Remedy that belongs to :data:`NOT_TRIED`."""


@cache
def all_structural_effects() -> dict[str, StructuralEffect]:
    """Return name -> effect of every module of the package that defines EFFECT."""
    found = effects_in(package, StructuralEffect)
    return {item.name: item for item in sorted(found, key=lambda item: item.name)}


def effects_of_files(files: Sequence[Path]) -> tuple[list[StructuralEffect], dict[str, Path]]:
    """Load the EFFECT of each file of a user once.

    Returns
    -------
    effects of a structure
        In the order of the files.
    effects on a damper
        Name -> file.

    Raises
    ------
    UserError
        If a file is missing, cannot be run, or defines no EFFECT, or if an effect has the name of another one or acts
        on an unknown place.
    """
    from mrpipe.effects.own import require_usable

    loaded: list[tuple[Path, Effect | StructuralEffect]] = []
    of_structure: list[StructuralEffect] = []
    of_damper: dict[str, Path] = {}
    for path in files:
        effect = effect_of_file(path)
        if isinstance(effect, StructuralEffect):
            of_structure.append(effect)
        elif isinstance(effect, Effect):
            of_damper[effect.name] = path
        else:
            remedy = "define EFFECT = StructuralEffect(...) as mrpipe/effects/structural/*.py do"
            raise UserError(path, "EFFECT", "is missing", remedy)
        loaded.append((path, effect))
    require_usable(loaded)
    return of_structure, of_damper


def structural_effects(names: Sequence[str] = (), own: Sequence[StructuralEffect] = ()) -> dict[str, StructuralEffect]:
    """Return the effects of these names (all if none of them is one of a structure), and those of the user."""
    of_user = {item.name: item for item in own}
    known = {**all_structural_effects(), **of_user}
    chosen = {name: known[name] for name in names if name in known} or known
    return {**chosen, **of_user}
