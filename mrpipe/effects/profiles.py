"""Free profiles: forms of an effect that are a free function of one quantity.

The other forms of an effect are formulas, and a real damper follows none of them exactly. Once an effect is named, its
profile can be estimated instead: a sum of fixed basis functions with coefficients that are not negative. The profile
keeps the physical constraints (the friction falls with the speed, the drag rises faster than the speed, the force
returns after a reversal), and the measurement determines the rest. The fit solves for all coefficients at once, because
the force is linear in them.
"""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.parameters import Parameter, Values, amplitude
from mrpipe.dampers.plant import (
    FORCE,
    HYSTERETIC_FORCE,
    SINCE_REVERSAL,
    SLIP,
    STEP_SIGNATURE,
    VELOCITY,
    Phase,
    Step,
)
from mrpipe.effects.contract import EffectForm

SPEED, PATH, SINCE = 0.0, 1.0, 2.0
"""Quantities of a profile: speed, path since the last reversal, time since the last reversal."""

FALLING, RISING, CONVEX = 0.0, 1.0, 2.0
"""Kinds of basis functions: steps down, exponential rises, and functions that rise ever faster."""

PLACES = {
    FALLING: (0.04, 0.1, 0.25, 0.6, 1.5),
    RISING: (0.04, 0.12, 0.36, 1.1, 3.3),
    CONVEX: (0.05, 0.2, 0.35, 0.5, 0.65, 0.8),
}
"""Numerical technique: places of the basis functions, in units of the scale of the profile. They are close enough for
any profile of their kind, because steps and rises are wider than their distance."""

WIDTH = 0.15
"""Numerical technique: distance of the places of convex functions, in units of the scale of the profile."""


@njit(STEP_SIGNATURE, cache=True)
def profile_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: coefficient, place of the basis function [unit of the quantity], its width, quantity, kind.

    Steps down and rises are factors of the hysteretic force; convex functions are forces against the motion [N].
    """
    if parameters[3] == 0.0:
        quantity = abs(wire[VELOCITY])
    elif parameters[3] == 1.0:
        quantity = wire[SLIP]
    else:
        quantity = wire[SINCE_REVERSAL]
    if parameters[4] == 0.0:
        value = wire[HYSTERETIC_FORCE] / (1.0 + (quantity / parameters[1]) ** 4)
    elif parameters[4] == 1.0:
        value = wire[HYSTERETIC_FORCE] * (1.0 - math.exp(-quantity / parameters[1]))
    else:
        # zero before its position, a parabola over its width, then a straight line: sums of them are convex and smooth
        beyond = min(max(quantity - parameters[1], 0.0), parameters[2])
        value = 0.5 * beyond * beyond / parameters[2] + max(quantity - parameters[1] - parameters[2], 0.0)
        if wire[VELOCITY] < 0.0:
            value = -value
    wire[FORCE] += parameters[0] * value


def free_profile(
    name: str, summary: str, quantity: float, kind: float, scale: Parameter, coefficient: Parameter
) -> EffectForm:
    """Return a form whose strength is a free function of a quantity.

    Parameters
    ----------
    name, summary
        Name and summary of the form.
    quantity
        :data:`SPEED`, :data:`PATH` or :data:`SINCE`.
    kind
        :data:`FALLING` or :data:`RISING` (factors of the hysteretic force) or :data:`CONVEX` (a force [N]).
    scale
        Parameter whose value is the unit of the positions; it is searched.
    coefficient
        Unit, meaning and bounds of each coefficient.
    """
    places = PLACES[kind]
    names = [f"{coefficient.name}_{number}" for number in range(1, len(places) + 1)]

    def steps(values: Values) -> list[Step]:
        unit = values[scale.name]
        return [
            Step(
                "profile",
                Phase.FORCE_EFFECT,
                profile_step,
                np.array([values[own], place * unit, WIDTH * unit, quantity, kind]),
            )
            for own, place in zip(names, places, strict=True)
        ]

    coefficients = tuple(
        amplitude(
            own,
            coefficient.unit,
            f"{coefficient.meaning}, part at {place:g} of the scale",
            coefficient.scale,
            coefficient.lower,
            coefficient.upper,
        )
        for own, place in zip(names, places, strict=True)
    )
    return EffectForm(name, summary, (scale, *coefficients), steps, {own: place for place, own in enumerate(names)})
