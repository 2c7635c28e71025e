"""Checks of an effect file of a user, for effects of dampers and of structures."""

from __future__ import annotations

from pathlib import Path

from mrpipe.effects import checks as damper_checks
from mrpipe.effects.checks import Check
from mrpipe.effects.contract import Effect
from mrpipe.effects.library import all_effects, effect_of_file
from mrpipe.effects.structural import checks as structural_checks
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.errors import UserError


def check_file(path: Path) -> tuple[Effect | StructuralEffect, list[Check]]:
    """Load the EFFECT of a file, and return it with the result of every demand on it.

    Raises
    ------
    UserError
        If the file is missing, cannot be run, or defines no EFFECT.
    """
    effect = effect_of_file(path, "")
    known = [*all_effects(), *all_structural_effects()]
    own_name = Check("", "The name is not that of an effect of the program", _taken(getattr(effect, "name", ""), known))
    if isinstance(effect, Effect):
        return effect, [own_name, *damper_checks.checks_of(effect, known)]
    if isinstance(effect, StructuralEffect):
        return effect, [own_name, *structural_checks.checks_of(effect, known)]
    raise UserError(
        path,
        "EFFECT",
        "is missing" if effect is None else f"is a {type(effect).__name__}",
        "define EFFECT = Effect(...) for a damper or StructuralEffect(...) for a structure",
    )


def _taken(name: str, known: list[str]) -> str:
    return f"{name} is an effect of the program already" if name in known else ""
