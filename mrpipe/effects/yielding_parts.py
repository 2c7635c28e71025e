"""A form of `rate-dependent-yield` whose yielding parts have their own dependence on the drive.

Where a model's error outweighs the sensors' noise, one yield force for everything is too stiff a form: in real dampers
a plug that slips without regard to speed and a part that shears with it are in parallel, and each rises in its own way
with the drive. That is richer than a candidate for a small residual may be, so it is no part of the library: it is
judged where the base form itself is in question.
"""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, FORCE, STEP_SIGNATURE, Phase, Step
from mrpipe.dampers.viscoplastic import follow_dashpot
from mrpipe.effects.contract import Effect, EffectForm, Values, amplitude, shape

DASHPOT = 20
"""Place on the wire, free in :mod:`mrpipe.dampers.plant`, of the part's normalised force."""


@njit(STEP_SIGNATURE, cache=True)
def dashpot_part_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: spring rate [1/m], velocity scale [m/s]. State: atanh z, last velocity."""
    wire[DASHPOT] = follow_dashpot(wire, state, parameters[0], parameters[1], dt)


@njit(STEP_SIGNATURE, cache=True)
def part_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, power of the drive."""
    wire[FORCE] += parameters[0] * wire[CURRENT] ** parameters[1] * wire[DASHPOT]


def _part(value: float, power: int) -> Step:
    return Step("yielding-part", Phase.FORCE_EFFECT, part_force_step, np.array([value, float(power)]))


def _dashpot(values: Values) -> list[Step]:
    numbers = np.array([values["spring_rate"], values["velocity_scale"]])
    return [
        Step("dashpot-part", Phase.HYSTERESIS, dashpot_part_step, numbers, 2),
        *(_part(values[name], power) for power, name in enumerate(("force", "force_rate", "force_square"))),
    ]


_SPRING = shape(
    "spring_rate", "1/m", "stiffness of the spring over the part's force", "one/stroke", 2.0, 1500.0, (60.0, 250.0)
)
_SPEED = shape("velocity_scale", "m/s", "speed of the dashpot", "speed", 0.005, 1.0, (0.04, 0.12))
_PARTS = (
    amplitude("force", "N", "force of the part that needs speed, no drive", "force", -0.1, 10.0),
    amplitude("force_rate", "N/drive", "its rise with the drive", "force/drive", -10.0, 20.0),
    amplitude("force_square", "N/drive^2", "its curvature", "force/drive^2", -20.0, 20.0),
)
OWN_DASHPOT = EffectForm(
    "own-dashpot",
    "F + (a + b u + c u^2) z, z' = q (v - v0 atanh z)",
    (_SPRING, _SPEED, *_PARTS),
    _dashpot,
    {"force": 1, "force_rate": 2, "force_square": 3},
)

STIFF_DASHPOT = replace(
    OWN_DASHPOT,
    name="own-dashpot-stiff",
    parameters=(replace(_SPRING, starts=(450.0, 900.0)), _SPEED, *_PARTS),
)
"""The same law from starts of its own: a soft and a stiff spring are two optima with a ridge between them."""

CONTAINED = ("rounded", "algebraic", "saturating-dashpot")
"""Forms of the library that this one contains: a stiff spring rounds the force with speed alone."""


def with_yielding_parts(effects: Mapping[str, Effect]) -> dict[str, Effect]:
    """Return the effects with this form in `rate-dependent-yield`, in place of those that it contains."""
    found = dict(effects)
    effect = found.get("rate-dependent-yield")
    if effect is not None:
        others = tuple(form for form in effect.forms if form.name not in CONTAINED)
        found["rate-dependent-yield"] = replace(effect, forms=(OWN_DASHPOT, STIFF_DASHPOT, *others))
    return found
