"""What an effect of a user must be before it is tried: its name is free, and it acts on something that is known."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import get_args

from mrpipe.artifacts.yaml_source import closest, nearest
from mrpipe.effects.contract import Effect, Quantity
from mrpipe.effects.library import all_effects
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.errors import UserError

QUANTITIES: tuple[str, ...] = get_args(Quantity)
"""Quantities of a damper that an effect can modify."""

PLACES = ("storey", "floor", "base")
"""Places of a structure where an effect of a file can act. Those on the rod of the damper and on the command of the
controller are found by functions of the program that know them by name."""


def place_failure(effect: Effect | StructuralEffect) -> str:
    """Return what is wrong with the key `acts_on` of an effect; empty if nothing is."""
    known = QUANTITIES if isinstance(effect, Effect) else PLACES
    if effect.acts_on in known:
        return ""
    likeliest = closest(str(effect.acts_on), known)
    hint = f"did you mean {likeliest}? " if likeliest else ""
    return f"acts_on is {effect.acts_on!r} ({hint}known: {', '.join(known)})"


def name_failure(name: str) -> str:
    """Return that a name is that of an effect of the program; empty if it is not."""
    taken = name in all_effects() or name in all_structural_effects()
    return f"{name!r} is already the name of an effect of the program" if taken else ""


def require_free_names(named: Iterable[tuple[Path, str]]) -> None:
    """Refuse effects of a user whose name an effect of the program, or of another file of the user, has.

    Without this, the effect of the file would take the place of the other one, and the verdict would not say so.

    Parameters
    ----------
    named
        File and name of each effect; a name that is not known yet is empty.

    Raises
    ------
    UserError
        If a name is taken.
    """
    files: dict[str, Path] = {}
    for path, name in named:
        other = files.get(name)
        failure = f"{name!r} is also the name of the effect in {other}" if other else name_failure(name)
        if failure:
            raise UserError(path, "EFFECT, name", failure, "give this effect another name")
        if name:
            files[name] = path


def require_usable(effects: Sequence[tuple[Path, Effect | StructuralEffect]]) -> None:
    """Refuse effects of a user that have the name of another effect, or act on something that is not known.

    Raises
    ------
    UserError
        If there is one; the message names its file.
    """
    require_free_names((path, effect.name) for path, effect in effects)
    for path, effect in effects:
        failure = place_failure(effect)
        if failure:
            raise UserError(path, "EFFECT", failure, "write one of these words")


def require_candidates(names: Sequence[str], known: Collection[str]) -> None:
    """Refuse an unknown effect in the setting `close_loop.candidates`.

    Raises
    ------
    UserError
        If there is one; the message names the nearest known effect.
    """
    for place, name in enumerate(names):
        if name not in known:
            raise UserError("close_loop", f"candidates[{place}]", f"no effect {name!r}", nearest(name, known))
