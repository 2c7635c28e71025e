"""Writes docs/effects.md from the effects themselves: `python -m mrpipe.effects.document > docs/effects.md`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from mrpipe.effects.contract import Effect, Separation
from mrpipe.effects.library import damper_effects
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.effects.structural.library import all_structural_effects

_HEAD = """\
# Effects

Every effect that `mrpipe close-loop` can name: its physics, the residual of a model without it, the tests that reveal
it, and what to do on the rig. Effects of a damper are found on a bench campaign; effects of a structure on a
shear-frame campaign. Your own effects work the same way: [write-an-effect.md](write-an-effect.md).

This page is written by `python -m mrpipe.effects.document > docs/effects.md`.
"""

_NEEDS = {
    "varying-drive": "tests in which the drive changes (steps)",
    "varying-speed": "tests at several speeds",
    "several-frequencies": "tests at several frequencies",
    "several-positions": "tests about several positions of the stroke",
    "long-tests": "long tests",
}


def as_markdown() -> str:
    """Return the page."""
    damper, frame = damper_effects(), all_structural_effects()
    lines = [_HEAD, "\n| effect | in a sentence |\n| --- | --- |\n"]
    for effect in (*damper.values(), *frame.values()):
        lines.append(f"| [{effect.name}](#{effect.name}) | {effect.summary} |\n")
    lines.append("\n# Effects of a damper\n")
    lines += [_damper(effect) for effect in damper.values()]
    lines.append("\n# Effects of a structure\n")
    lines += [_structural(effect) for effect in frame.values()]
    return "".join(lines)


def _damper(effect: Effect) -> str:
    needs = [_NEEDS[item] for item in effect.needs]
    note = "\n\nIt is a fault of a sensor or of the time base: `prepare` corrects it, and it never enters the damper."
    return (
        _head(effect)
        + f"\n\n**Acts on:** {effect.acts_on}."
        + (f" **Needs:** {'; '.join(needs)}." if needs else "")
        + (note if effect.sensor else "")
        + _tests(effect.separated_by)
        + _forms([(form.name, form.summary, form.parameters) for form in (*effect.forms, *effect.refinements)])
    )


def _structural(effect: StructuralEffect) -> str:
    place = {"storey": "a storey", "floor": "a floor", "base": "the base"}.get(effect.acts_on, effect.acts_on)
    return (
        _head(effect)
        + f"\n\n**Acts on:** {place}."
        + _tests(effect.separated_by)
        + _forms([(form.name, form.summary, (*form.searched, *form.amplitudes)) for form in effect.forms])
    )


def _head(effect: Effect | StructuralEffect) -> str:
    return (
        f"\n## {effect.name}\n{effect.summary[:1].upper()}{effect.summary[1:]}.\n\n"
        f"**Physics:** {effect.physics}\n\n**Residual:** {effect.residual}\n\n**Remedy:** {effect.remedy}\n\n"
        f"**Source:** {effect.source}."
    )


def _tests(separated_by: Mapping[str, Separation]) -> str:
    if not separated_by:
        return ""
    rows = "\n".join(f"- from {name}: {item.advice}" for name, item in separated_by.items())
    return f"\n\n**Tests that separate it:**\n\n{rows}"


def _forms(forms: list[tuple[str, str, tuple[Any, ...]]]) -> str:
    lines = ["\n\n| form | law | parameters |\n| --- | --- | --- |\n"]
    for name, summary, parameters in forms:
        listed = ", ".join(f"{item.name.replace('_', ' ')} [{item.unit}]" for item in parameters)
        lines.append(f"| {name} | {summary.replace('|', chr(92) + '|')} | {listed} |\n")
    return "".join(lines)


if __name__ == "__main__":
    sys.stdout.write(as_markdown())
