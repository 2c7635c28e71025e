"""Dampers with effects, read from an artifact: the library of effects turns names into steps."""

from __future__ import annotations

from pathlib import Path

from mrpipe.artifacts import Artifact
from mrpipe.dampers.model import Addition, DamperModel
from mrpipe.dampers.model import read_damper as read_plain
from mrpipe.effects.library import damper_effects, load_effect_file
from mrpipe.errors import UserError


def read_damper(artifact: Artifact, group: str = "damper") -> DamperModel:
    """Read a damper with its effects.

    Raises
    ------
    UserError
        If an effect is not known, or the file that defines it is missing.
    """

    def effect(name: str, form: str, file: str) -> Addition:
        known = damper_effects()
        if not file and name not in known:
            raise UserError(artifact.path, f"{group}/effects", f"no effect {name!r}", "build it again with --force")
        found = load_effect_file(Path(file)) if file else known[name]
        shape = found.form(form)
        units = {item.name: item.unit for item in shape.parameters}
        return Addition(name, form, {}, units, found.sensor, shape.steps, file)

    return read_plain(artifact, group, effect=effect)
