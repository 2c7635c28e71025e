"""Conversion of a fit to a damper model: the base form and the effects with their fitted numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping

from mrpipe.dampers.laws import law_names
from mrpipe.dampers.model import Addition, DamperModel
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.problem import Term
from mrpipe.fitting.settings import ASSUMED_ETA


def damper_model(
    found: Fit,
    drive_unit: str,
    *,
    effects: bool = False,
    assumed_eta: float = ASSUMED_ETA,
    effect_files: Mapping[str, str] | None = None,
) -> DamperModel:
    """Return the damper model of a fit.

    Parameters
    ----------
    found
        The fit.
    drive_unit
        `A` or `V`.
    effects
        Whether the model contains the effects; otherwise it is the base form alone.
    assumed_eta
        Rate of the lag of the drive [1/s] if the recordings do not determine it; infinite: no lag.
    effect_files
        Name of an effect -> the user's file that defines it.
    """
    base, scales = found.problem.base, found.problem.scales
    numbers: dict[str, float] = {}
    kinds: dict[str, str] = {}
    for block, law in zip(base.form.blocks, found.laws, strict=True):
        names = law_names(block, law)
        numbers |= dict(zip(names, law.numbers, strict=True))
        if law.kind != "polynomial":
            kinds[block] = law.kind
    values = {name: value for name, value in found.base_values.items() if name not in numbers}
    numbers |= values
    if not base.lag_known and math.isfinite(assumed_eta):
        numbers["eta"] = assumed_eta
    added = [
        addition(term, given, drive_unit, (effect_files or {}).get(term.effect.name, ""))
        for term, given in zip(found.problem.terms, found.term_values, strict=True)
    ]
    return DamperModel(
        base.name,
        numbers,
        drive_unit,
        scales.drive,
        kinds,
        tuple(added) if effects else (),
        scales.stroke,
        base.form.file,
    )


def addition(term: Term, values: dict[str, float], drive_unit: str, file: str = "") -> Addition:
    """Return an effect of a fit with its numbers, in the form in which a damper model holds it."""
    units = {item.name: item.unit.replace("drive", drive_unit) for item in term.form.parameters}
    return Addition(term.effect.name, term.form.name, values, units, term.effect.sensor, term.form.steps, file)
