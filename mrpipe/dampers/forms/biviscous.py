"""Biviscous model."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Parameter, Values, constant, shape
from mrpipe.dampers.plant import HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_FORCE, Phase, Step

LEAST_RATIO = 1e-6
"""Numerical technique: least yield force over the reference, so that the yield velocity stays above zero."""

GROWTH = Parameter(
    "growth", "1", "power of the yield force that the yield velocity grows with", "one", 0.0, 1.0, (1.0, 0.0)
)
"""1: the viscosity before yield is constant; 0: the yield velocity is constant."""

REFERENCE_FORCE = constant("reference_force", "N", "yield force at which the yield velocity is given", "force")


@njit(float64(float64, float64, float64, float64), cache=True)
def yield_velocity(velocity: float, yield_force: float, reference_force: float, growth: float) -> float:
    """Return v_y = velocity (yield_force/reference_force)^growth [m/s]."""
    if growth == 0.0:
        return velocity
    return velocity * max(yield_force / reference_force, LEAST_RATIO) ** growth


@njit(STEP_SIGNATURE, cache=True)
def biviscous_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: yield velocity [m/s] at the reference force, growth, reference force [N]."""
    width = yield_velocity(parameters[0], wire[YIELD_FORCE], parameters[2], parameters[1])
    wire[HYSTERESIS] = min(max(wire[VELOCITY] / width, -1.0), 1.0)


def growth_of(values: Values) -> tuple[float, float]:
    """Return growth and reference force [N]; the yield velocity is constant where they are left out."""
    return values.get("growth", 0.0), values.get("reference_force", 1.0)


def _steps(values: Values) -> list[Step]:
    growth, reference = growth_of(values)
    numbers = np.array([values["yield_velocity"], growth, reference])
    return [Step("biviscous", Phase.HYSTERESIS, biviscous_step, numbers)]


def width_of(values: Values, at: Strength) -> FloatArray:
    """Return the yield velocity [m/s] at these yield forces."""
    growth, reference = growth_of(values)
    ratio = np.maximum(at.yield_force / reference, LEAST_RATIO)
    return np.asarray(values["yield_velocity"] * ratio**growth, dtype=np.float64)


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum(np.minimum(at.speed / width_of(values, at), 1.0), at)


FORM = BaseForm(
    name="biviscous",
    summary="two viscosities: F_y v/v_y + c0 v below the yield velocity v_y = v_r (F_y/F_r)^p, F_y + c0 v beyond it",
    source="Stanway, Sproston, El-Wahed 1996, Smart Mater. Struct. 5, 464-482; Wereley, Pang, Kamath 1998",
    parameters=(
        shape("yield_velocity", "m/s", "speed at which it yields", "speed", 1e-3, 1.0, (0.05, 0.2, 0.01)),
        GROWTH,
        REFERENCE_FORCE,
    ),
    steps=_steps,
    post_yield=_post_yield,
    coupled=True,
)
