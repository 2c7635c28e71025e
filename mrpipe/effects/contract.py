"""What an effect is: the one narrow contract that every file of this package (and a user's own file) keeps.

A file defines `EFFECT = Effect(...)` and nothing else knows of it. An effect has one or several *forms*: functional
shapes of the same physics. A form turns parameter values into steps of a chain (:mod:`mrpipe.dampers.plant`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from mrpipe.dampers.plant import Step

Values = Mapping[str, float]
Scale = Literal["one", "stroke", "speed", "acceleration", "drive", "force", "time"]
Needs = Literal["varying-drive", "varying-speed", "several-frequencies", "several-positions", "long-tests"]


@dataclass(frozen=True)
class EffectScales:
    """What bounds and starts of parameters are multiples of.

    Attributes
    ----------
    stroke
        Half the largest peak-to-peak displacement [m].
    speed, acceleration
        Largest of the motions [m/s], [m/s^2].
    drive
        Largest drive [A or V].
    force
        RMS of the force [N].
    time
        Longest test [s].
    """

    stroke: float
    speed: float
    acceleration: float
    drive: float
    force: float
    time: float

    def of(self, expression: str) -> float:
        """Return a product or quotient of scales such as `force/stroke` or `force/speed^2`."""
        result = 1.0
        for position, part in enumerate(expression.split("/")):
            for factor in part.split("*"):
                name, _, power = factor.partition("^")
                value = 1.0 if name == "one" else float(getattr(self, name)) ** int(power or 1)
                result = result * value if position == 0 else result / value
        return result


@dataclass(frozen=True)
class Parameter:
    """A number of a form.

    Attributes
    ----------
    name, unit
        SI; `drive` stands for A or V.
    meaning
        What it is, in a few words.
    scale
        Product of :class:`EffectScales` that `lower`, `upper` and `starts` are multiples of, such as `force/stroke`.
    lower, upper, starts
        Bounds and starts; a strength starts at the first.
    role
        `shape` (searched), `strength` (searched; the effect vanishes at 0), `level` (searched; the effect sets in only
        beyond it, and vanishes at 0) or `amplitude` (a force proportional to it: solved for exactly; vanishes at 0).
    logarithmic
        Searched as its logarithm.
    """

    name: str
    unit: str
    meaning: str
    scale: str
    lower: float
    upper: float
    starts: tuple[float, ...]
    role: Literal["shape", "strength", "level", "amplitude"] = "shape"
    logarithmic: bool = False

    def bounds(self, scales: EffectScales) -> tuple[float, float]:
        """Return lower and upper bound in SI."""
        unit = scales.of(self.scale)
        return self.lower * unit, self.upper * unit

    def start_values(self, scales: EffectScales) -> tuple[float, ...]:
        """Return the starts in SI."""
        unit = scales.of(self.scale)
        return tuple(start * unit for start in self.starts)


def shape(
    name: str, unit: str, meaning: str, scale: str, lower: float, upper: float, starts: tuple[float, ...]
) -> Parameter:
    """Return a positive shape parameter, searched as its logarithm."""
    return Parameter(name, unit, meaning, scale, lower, upper, starts, "shape", True)


def strength(name: str, unit: str, meaning: str, scale: str, lower: float, upper: float, start: float) -> Parameter:
    """Return a strength at which the effect vanishes for 0; `start` is the small value that screening uses."""
    return Parameter(name, unit, meaning, scale, lower, upper, (start,), "strength")


def amplitude(name: str, unit: str, meaning: str, scale: str, lower: float = 0.0, upper: float = 50.0) -> Parameter:
    """Return an amplitude that the force is proportional to; a lower bound below 0 allows either sign."""
    return Parameter(name, unit, meaning, scale, lower, upper, (1.0,), "amplitude")


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
        (values) -> steps of the chain. Every amplitude has a step of its own, at the place of `amplitude_steps`.
    amplitude_steps
        Amplitude -> index in what `steps` returns.
    dissipative
        With parameters within bounds the force it adds or changes never feeds energy over a closed cycle.
    strength_for_zero
        Strengths that make the effect vanish (all 0 where empty).
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
        return tuple(item for item in self.parameters if item.role != "amplitude")

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that are solved for."""
        return tuple(item for item in self.parameters if item.role == "amplitude")

    def without_strength(self, scales: EffectScales) -> dict[str, float]:
        """Return values at which nothing changes: strengths and amplitudes 0, shapes at their first start."""
        return {p.name: p.start_values(scales)[0] if p.role == "shape" else 0.0 for p in self.parameters}


@dataclass(frozen=True)
class Described:
    """What every effect says of itself, be it one of a damper or of a structure.

    Attributes
    ----------
    name, summary
        As the contract lists them; what it does, in a line.
    physics, remedy
        Sentences for the report: where it comes from, and what to do on the rig.
    source
        Where the law is described.
    """

    name: str
    summary: str
    physics: str
    remedy: str
    source: str


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
        Other effect -> test that tells the two apart.
    refinements
        Richer forms of the same physics, too supple to name it by: once it is named, one of them takes the form's place
        where it is better on tests left out.
    """

    acts_on: str
    forms: tuple[EffectForm, ...]
    needs: tuple[Needs, ...] = ()
    sensor: bool = False
    rig: Literal["damper", "frame"] = "damper"
    separated_by: Mapping[str, str] = field(default_factory=dict)
    refinements: tuple[EffectForm, ...] = ()

    def form(self, name: str) -> EffectForm:
        """Return one form by name."""
        return next(item for item in (*self.forms, *self.refinements) if item.name == name)
