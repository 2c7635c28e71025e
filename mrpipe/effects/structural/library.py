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


@cache
def all_structural_effects() -> dict[str, StructuralEffect]:
    """Return name -> effect of every module of the package that defines EFFECT."""
    found = effects_in(package, StructuralEffect)
    return {item.name: item for item in sorted(found, key=lambda item: item.name)}


def load_structural_file(path: Path) -> StructuralEffect | None:
    """Return the EFFECT of a file of a user if it is one of a structure; None if it is one of a damper.

    Raises
    ------
    UserError
        If the file is missing, cannot be run, or defines no EFFECT.
    """
    effect = effect_of_file(path)
    if isinstance(effect, StructuralEffect):
        return effect
    if not isinstance(effect, Effect):
        remedy = "define EFFECT = StructuralEffect(...) as mrpipe/effects/structural/*.py do"
        raise UserError(path, "EFFECT", "is missing", remedy)
    return None


def structural_effects(names: Sequence[str] = (), files: Sequence[Path] = ()) -> dict[str, StructuralEffect]:
    """Return the effects of these names (all if none of them is one of a structure), and those of the files."""
    known = all_structural_effects()
    chosen = {name: known[name] for name in names if name in known} or dict(known)
    own = [item for item in map(load_structural_file, files) if item is not None]
    return {**chosen, **{item.name: item for item in own}}
