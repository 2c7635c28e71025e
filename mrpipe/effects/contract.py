"""What an effect is: the one narrow contract that every file of this package (and a user's own file) keeps.

A file defines `EFFECT = Effect(...)` and nothing else knows of it. An effect has one or several *forms*: functional
shapes of the same physics. A form turns parameter values into steps of a chain (:mod:`mrpipe.dampers.plant`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from mrpipe.dampers.parameters import Parameter, Values, amplitude, shape, strength
from mrpipe.dampers.parameters import Scales as EffectScales
from mrpipe.dampers.plant import Step

__all__ = [
    "Described",
    "Effect",
    "EffectForm",
    "EffectScales",
    "Needs",
    "Parameter",
    "Values",
    "amplitude",
    "shape",
    "strength",
]

Needs = Literal["varying-drive", "varying-speed", "several-frequencies", "several-positions", "long-tests"]
TestKind = Literal[
    "speeds", "steps", "positions", "middle", "frequencies", "amplitudes", "long", "reversal", "constants", "rest"
]
"""Kinds of bench test: triangles at several speeds; steps of the drive; dwells at several positions; motion about
another middle; several frequencies; other amplitudes; a long run with a pause; slow small triangles about reversal;
constant drives at several speeds; rest at several drives."""
TESTS_FOR: Mapping[Needs, TestKind] = {
    "varying-drive": "steps",
    "varying-speed": "speeds",
    "several-frequencies": "frequencies",
    "several-positions": "positions",
    "long-tests": "long",
}
"""Need that a campaign does not meet -> kind of test that meets it."""


@dataclass(frozen=True)
class EffectForm:
    """One functional shape of an effect.

    Attributes
    ----------
    name, summary
        Key within the effect; the law in a line.
    parameters
        Its numbers.
    steps
        (values) -> steps of the chain. Every amplitude has one step, at the place of `amplitude_steps`.
    amplitude_steps
        Amplitude -> index in what `steps` returns.
    dissipative
        With parameters within bounds the force it adds or changes never feeds energy over a closed cycle.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    steps: Callable[[Values], list[Step]]
    amplitude_steps: Mapping[str, int] = field(default_factory=dict)
    dissipative: bool = False

    @property
    def searched(self) -> tuple[Parameter, ...]:
        """Parameters that a fit searches."""
        return tuple(item for item in self.parameters if item.role not in ("amplitude", "constant"))

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that are solved for."""
        return tuple(item for item in self.parameters if item.role == "amplitude")

    def without_strength(self, scales: EffectScales) -> dict[str, float]:
        """Return values at which nothing changes: strengths and amplitudes 0, shapes at their first start."""
        return {p.name: p.start_values(scales)[0] if p.role == "shape" else 0.0 for p in self.parameters}


@dataclass(frozen=True)
class Separation:
    """A test that separates an effect from another one that looks alike.

    Attributes
    ----------
    advice
        A sentence for people.
    kinds
        Kinds of bench test that `close-loop` then proposes; empty where no bench test does it.
    """

    advice: str
    kinds: tuple[TestKind, ...] = ()


@dataclass(frozen=True)
class Described:
    """What every effect says of itself, be it one of a damper or of a structure.

    Attributes
    ----------
    name, summary
        Key of the effect; what it does, in a line.
    physics, remedy
        Sentences for the report: where it comes from, and what to do on the rig.
    source
        Where the law is described.
    residual
        What the residual of a model without the effect looks like, for docs/effects.md.
    """

    name: str
    summary: str
    physics: str
    remedy: str
    source: str
    residual: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class Effect(Described):
    """A physical effect that a model may lack.

    Attributes
    ----------
    acts_on
        What it modifies (`rod motion`, `effective drive`, `yield force`, `viscous force`, `force`, `time base`).
    forms
        One or several functional shapes.
    needs
        What a campaign must hold for the effect to show at all.
    sensor
        A fault of sensors or time base: corrected in prepare, never put into the plant.
    rig
        `damper` or `frame`.
    separated_by
        Other effect -> test that separates the two.
    refinements
        Richer forms of the same physics, too supple to name it by: once it is named, one of them takes the form's place
        where it is better on tests left out.
    law_of_drive
        It bends the drive, so that a law of the drive that levels off does much the same.
    """

    acts_on: str
    forms: tuple[EffectForm, ...]
    needs: tuple[Needs, ...] = ()
    sensor: bool = False
    rig: Literal["damper", "frame"] = "damper"
    separated_by: Mapping[str, Separation] = field(default_factory=dict)
    refinements: tuple[EffectForm, ...] = ()
    law_of_drive: bool = False

    def form(self, name: str) -> EffectForm:
        """Return one form by name."""
        return next(item for item in (*self.forms, *self.refinements) if item.name == name)
