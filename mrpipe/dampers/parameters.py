"""Parameters of base forms and effects; bounds and starts are multiples of scales of the campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Values = Mapping[str, float]


@dataclass(frozen=True)
class Scales:
    """Scales of a campaign, of which bounds and starts of parameters are multiples.

    Attributes
    ----------
    stroke
        Half the largest peak-to-peak displacement [m].
    speed, acceleration
        Largest speed [m/s] and acceleration [m/s^2] of the motions.
    drive
        Largest drive [A or V].
    force
        RMS of the force [N].
    time
        Duration of the longest test [s].
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
    """A parameter of a form.

    Attributes
    ----------
    name, unit
        Name, and unit in SI; `drive` in a unit stands for A or V.
    meaning
        Meaning of the parameter, in a few words.
    scale
        Product of :class:`Scales` that `lower`, `upper` and `starts` are multiples of, such as `force/stroke`.
    lower, upper, starts
        Bounds and starts. A strength starts at the first value, which is small. Its other starts are for effects whose
        error first rises with the strength before it falls: a gap that is too small delays every reversal without
        explaining any.
    role
        `shape` (searched), `strength` (searched; the effect vanishes at 0), `level` (searched; the effect acts only
        beyond it, and vanishes at 0), `amplitude` (a force proportional to it; the fit solves for it exactly; vanishes
        at 0) or `constant` (a reference that fixes the meaning of other numbers: the first start, never fitted).
    logarithmic
        Whether the search uses its logarithm.
    """

    name: str
    unit: str
    meaning: str
    scale: str
    lower: float
    upper: float
    starts: tuple[float, ...]
    role: Literal["shape", "strength", "level", "amplitude", "constant"] = "shape"
    logarithmic: bool = False

    def bounds(self, scales: Scales) -> tuple[float, float]:
        """Return lower and upper bound in SI."""
        unit = scales.of(self.scale)
        return self.lower * unit, self.upper * unit

    def start_values(self, scales: Scales) -> tuple[float, ...]:
        """Return the starts in SI."""
        unit = scales.of(self.scale)
        return tuple(start * unit for start in self.starts)


class Parametrised:
    """A form that is described by its parameters.

    Attributes
    ----------
    parameters
        Parameters of the form.
    """

    parameters: tuple[Parameter, ...]

    @property
    def searched(self) -> tuple[Parameter, ...]:
        """Parameters that a fit searches."""
        return tuple(item for item in self.parameters if item.role not in ("amplitude", "constant"))

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that a fit solves for."""
        return tuple(item for item in self.parameters if item.role == "amplitude")


def shape(
    name: str, unit: str, meaning: str, scale: str, lower: float, upper: float, starts: tuple[float, ...]
) -> Parameter:
    """Return a positive shape parameter, searched as its logarithm."""
    return Parameter(name, unit, meaning, scale, lower, upper, starts, "shape", True)


def strength(
    name: str, unit: str, meaning: str, scale: str, lower: float, upper: float, start: float, *distant: float
) -> Parameter:
    """Return a strength; at 0 the effect vanishes.

    Parameters
    ----------
    name, unit, meaning, scale, lower, upper
        See :class:`Parameter`.
    start
        The small value that screening uses.
    distant
        Larger values from which the search begins as well.
    """
    return Parameter(name, unit, meaning, scale, lower, upper, (start, *distant), "strength")


def amplitude(name: str, unit: str, meaning: str, scale: str, lower: float = 0.0, upper: float = 50.0) -> Parameter:
    """Return an amplitude, to which the force is proportional; a lower bound below 0 allows both signs."""
    return Parameter(name, unit, meaning, scale, lower, upper, (1.0,), "amplitude")


def constant(name: str, unit: str, meaning: str, scale: str) -> Parameter:
    """Return a reference value that the scale determines; it is never fitted."""
    return Parameter(name, unit, meaning, scale, 1.0, 1.0, (1.0,), "constant")
