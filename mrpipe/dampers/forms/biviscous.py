"""Biviscous model."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Values, constant, shape
from mrpipe.dampers.plant import CURRENT, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step

REST = shape(
    "rest_share", "1", "yield velocity without drive over that at the largest drive", "one", 0.02, 2.0, (0.3, 1.0)
)
BEND = shape("bend", "1", "power of the drive that the yield velocity grows with", "one", 0.3, 3.0, (1.0,))
LARGEST_DRIVE = constant("largest_drive", "drive", "drive at which the yield velocity is given", "drive")
"""With a constant viscosity before yield, the yield velocity grows with the yield force, therefore with the drive."""


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def yield_velocity(velocity: float, drive: float, rest: float, bend: float, largest: float) -> float:
    """Return v_y = velocity (rest + (1 - rest) |drive/largest|^bend) [m/s]."""
    if rest == 1.0:
        return velocity
    return velocity * max(rest + (1.0 - rest) * (abs(drive) / largest) ** bend, 0.5 * rest)


@njit(STEP_SIGNATURE, cache=True)
def biviscous_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: yield velocity [m/s] at the largest drive, its share without drive, power, largest drive."""
    width = yield_velocity(parameters[0], wire[CURRENT], parameters[1], parameters[2], parameters[3])
    wire[HYSTERESIS] = min(max(wire[VELOCITY] / width, -1.0), 1.0)


def growth_of(values: Values) -> tuple[float, float, float]:
    """Return share at rest, power and largest drive; the yield velocity is constant where they are left out."""
    return values.get("rest_share", 1.0), values.get("bend", 1.0), values.get("largest_drive", 1.0)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["yield_velocity"], *growth_of(values)])
    return [Step("biviscous", Phase.HYSTERESIS, biviscous_step, numbers)]


def width_of(values: Values, at: Strength) -> FloatArray:
    """Return the yield velocity [m/s] at these drives."""
    rest, bend, largest = growth_of(values)
    growth = np.maximum(rest + (1.0 - rest) * (np.abs(at.drive) / largest) ** bend, 0.5 * rest)
    return np.asarray(values["yield_velocity"] * growth, dtype=np.float64)


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum(np.minimum(at.speed / width_of(values, at), 1.0), at)


FORM = BaseForm(
    name="biviscous",
    summary="two viscosities: F_y v/v_y + c0 v below the yield velocity v_y(u), F_y + c0 v beyond it",
    source="Stanway, Sproston, El-Wahed 1996, Smart Mater. Struct. 5, 464-482; Wereley, Pang, Kamath 1998",
    parameters=(
        shape("yield_velocity", "m/s", "speed at which it yields", "speed", 1e-3, 1.0, (0.05, 0.2, 0.01)),
        REST,
        BEND,
        LARGEST_DRIVE,
    ),
    steps=_steps,
    post_yield=_post_yield,
)
