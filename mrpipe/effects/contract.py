"""Definition of an effect: the contract that every file of this package (and of a user) fulfils.

A file defines `EFFECT = Effect(...)`; no other module has to be changed. An effect has one or several *forms*:
functional shapes of the same physics. A form turns parameter values into steps of a chain
(:mod:`mrpipe.dampers.plant`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from mrpipe.dampers.parameters import Parameter, Parametrised, Values, amplitude, shape, strength
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
Quantity = Literal["rod motion", "effective drive", "yield force", "viscous force", "force", "time base"]
"""Quantity of a damper that an effect modifies."""
TestKind = Literal[
    "speeds", "steps", "positions", "middle", "frequencies", "amplitudes", "long", "reversal", "constants", "rest"
]
"""Kinds of bench test, in the order of the names: triangles at several speeds; steps of the drive; rest at several
positions; motion about another mean position; several frequencies; other amplitudes; a long run with a pause; small
slow triangles; constant drives at several speeds; rest at several drives.
"""
TESTS_FOR: Mapping[Needs, TestKind] = {
    "varying-drive": "steps",
    "varying-speed": "speeds",
    "several-frequencies": "frequencies",
    "several-positions": "positions",
    "long-tests": "long",
}
"""Need that a campaign does not meet -> kind of test that meets it."""


@dataclass(frozen=True)
class EffectForm(Parametrised):
    """One functional shape of an effect.

    Attributes
    ----------
    name, summary
        Key within the effect; the law in one line.
    parameters
        Parameters of the form.
    steps
        (values) -> steps of the chain. Every amplitude has one step, at the place of `amplitude_steps`.
    amplitude_steps
        Amplitude -> index of its step in the list that `steps` returns.
    dissipative
        Whether, with parameters within their bounds, the form never feeds energy into a closed cycle.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    steps: Callable[[Values], list[Step]]
    amplitude_steps: Mapping[str, int] = field(default_factory=dict)
    dissipative: bool = False

    def without_strength(self, scales: EffectScales) -> dict[str, float]:
        """Return values at which nothing changes: strengths and amplitudes 0, shapes at their first start."""
        return {p.name: p.start_values(scales)[0] if p.role == "shape" else 0.0 for p in self.parameters}


@dataclass(frozen=True)
class Separation:
    """A test that separates an effect from another one with a similar residual.

    Attributes
    ----------
    advice
        Advice for the reader, a sentence.
    kinds
        Kinds of bench test that `close-loop` then proposes; empty if no bench test separates them.
    """

    advice: str
    kinds: tuple[TestKind, ...] = ()


@dataclass(frozen=True)
class Described:
    """Texts of an effect of a damper or of a structure.

    Attributes
    ----------
    name, summary
        Key of the effect; the effect in one line.
    physics, remedy
        Sentences for the report: the physical cause, and what to do on the rig.
    source
        Publication that describes the law.
    residual
        Appearance of the residual of a model without the effect, for docs/effects.md.
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
        Quantity that it modifies.
    forms
        One or several functional shapes.
    needs
        Needs: tests that a campaign must contain to show the effect at all.
    sensor
        Whether it is a fault of sensors or of the time base, which prepare corrects and which is never part of the
        plant.
    rig
        `damper` or `frame`.
    separated_by
        Other effect -> test that separates the two.
    refinements
        Richer forms of the same physics, which are too flexible to identify the effect. Once it is named, one of them
        replaces the form if it is better on tests left out.
    law_of_drive
        Whether it limits the drive, so that a saturating law of the drive has a similar result.
    delays_of_drive
        Parameters that delay the drive [s]. Delays below one sampling interval are not named, because the course of
        the command between two samples is not recorded.
    """

    acts_on: Quantity
    forms: tuple[EffectForm, ...]
    needs: tuple[Needs, ...] = ()
    sensor: bool = False
    rig: Literal["damper", "frame"] = "damper"
    separated_by: Mapping[str, Separation] = field(default_factory=dict)
    refinements: tuple[EffectForm, ...] = ()
    law_of_drive: bool = False
    delays_of_drive: tuple[str, ...] = ()

    def form(self, name: str) -> EffectForm:
        """Return one form by name."""
        return next(item for item in (*self.forms, *self.refinements) if item.name == name)
