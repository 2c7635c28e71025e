"""All effects: those of the modules of the package, and those of files that the configuration names."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TypeVar

import mrpipe.effects as package
from mrpipe.dampers.user_file import module_of_file
from mrpipe.effects.contract import Effect
from mrpipe.effects.file_reading import REMEDY
from mrpipe.errors import UserError

LOADS_FROM = ("mrpipe.effects",)
"""Packages whose modules are found at run time; they are part of the code version of a stage."""
Kind = TypeVar("Kind")

OF_STRUCTURE = (
    "is an effect of a structure, and this is the tracing of a damper",
    "trace it on a campaign of a structure, or leave its file out of close_loop.effect_files",
)
"""Problem and remedy where the tracing of a damper gets an effect of a structure."""


def effects_in(place: ModuleType, kind: type[Kind]) -> list[Kind]:
    """Return the EFFECT of every module of a package that defines one of this kind."""
    modules = (
        importlib.import_module(f"{place.__name__}.{item.name}") for item in pkgutil.iter_modules(place.__path__)
    )
    found = (getattr(module, "EFFECT", None) for module in modules)
    return [effect for effect in found if isinstance(effect, kind)]


@cache
def all_effects() -> dict[str, Effect]:
    """Return name -> effect of every module of the package that defines EFFECT, damper effects first."""
    found = effects_in(package, Effect)
    found.sort(key=lambda item: (item.rig != "damper", item.name))
    return {item.name: item for item in found}


def damper_effects() -> dict[str, Effect]:
    """Return the effects on a damper."""
    return {name: item for name, item in all_effects().items() if item.rig == "damper"}


def effect_of_file(path: Path, setting: str = "close_loop.effect_files") -> object:
    """Run a file of a user and return its EFFECT of any kind; None if it defines none.

    Parameters
    ----------
    path
        The file.
    setting
        Setting that names the file, for messages.

    Raises
    ------
    UserError
        If the file is missing or cannot be run.
    """
    return getattr(module_of_file(Path(path), setting, REMEDY), "EFFECT", None)


def load_effect_file(path: Path) -> Effect:
    """Load the EFFECT of a file of a user.

    Raises
    ------
    UserError
        If the file is missing, cannot be run, or defines no EFFECT on a damper, or if its effect has the name of one of
        the program or acts on an unknown quantity.
    """
    from mrpipe.effects.own import require_usable
    from mrpipe.effects.structural.contract import StructuralEffect

    effect = effect_of_file(path)
    if isinstance(effect, StructuralEffect):
        raise UserError(path, "EFFECT", *OF_STRUCTURE)
    if not isinstance(effect, Effect):
        raise UserError(path, "EFFECT", "is missing", "define EFFECT = Effect(...) as mrpipe/effects/*.py do")
    require_usable([(path, effect)])
    return effect


def effects_named(names: Sequence[str], files: Sequence[Path] = ()) -> dict[str, Effect]:
    """Return the damper effects of these names (all if none is given), and those of the user's files.

    Raises
    ------
    UserError
        If a name is not known, or two effects have the same name.
    """
    from mrpipe.effects.own import require_candidates, require_usable

    loaded = [(path, load_effect_file(path)) for path in files]
    require_usable(loaded)
    own = {item.name: item for _, item in loaded}
    known = {**damper_effects(), **own}
    require_candidates(names, known)
    return {**{name: known[name] for name in names or known}, **own}
