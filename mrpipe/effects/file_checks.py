"""Checks of an effect file of a user, for effects of dampers and of structures."""

from __future__ import annotations

from pathlib import Path

from mrpipe.effects import checks as damper_checks
from mrpipe.effects.checks import Check
from mrpipe.effects.contract import Effect
from mrpipe.effects.library import all_effects, effect_of_file
from mrpipe.effects.own import name_failure, place_failure
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
    if isinstance(effect, Effect):
        return effect, [*_own(effect, "quantity of a damper"), *damper_checks.checks_of(effect, known)]
    if isinstance(effect, StructuralEffect):
        return effect, [*_own(effect, "place of a structure"), *structural_checks.checks_of(effect, known)]
    raise UserError(
        path,
        "EFFECT",
        "is missing" if effect is None else f"is of the type {type(effect).__name__}",
        "define EFFECT = Effect(...) for a damper or StructuralEffect(...) for a structure",
    )


def _own(effect: Effect | StructuralEffect, acts_on: str) -> list[Check]:
    """Return the demands on an effect of a user that the effects of the program meet by themselves."""
    return [
        Check("", "The name is not that of an effect of the program", name_failure(effect.name)),
        Check("", f"It acts on a known {acts_on}", place_failure(effect)),
    ]
