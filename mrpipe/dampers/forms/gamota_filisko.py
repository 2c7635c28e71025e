"""Model of Gamota and Filisko: a Bingham element in series with a standard linear solid."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, njit, void

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import parts_of
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import (
    FIRST,
    HYSTERESIS,
    OUTER_VELOCITY,
    STEP_SIGNATURE,
    VELOCITY,
    VISCOSITY,
    YIELD_FORCE,
    Phase,
    Step,
)
from mrpipe.dampers.viscoplastic import outer_velocity

_SDIRK = 1.0 - math.sqrt(0.5)


@njit(float64(float64, float64, float64, float64), cache=True)
def _stage_force(slope: float, right: float, creep: float, yield_force: float) -> float:
    """Return f with slope f + creep max(|f| - F_y, 0) sign f = right."""
    force = right / slope
    if abs(force) <= yield_force:
        return force
    return math.copysign((abs(right) + creep * yield_force) / (slope + creep), right)


@njit(void(float64[::1], float64, float64, float64, float64, float64, float64[::1]), cache=True)
def _advance(
    state: FloatArray, first: float, last: float, strength: float, viscosity: float, dt: float, solid: FloatArray
) -> None:
    """Advance Kelvin deformation and force/k2 [m] while the rod velocity changes from `first` to `last` [m/s].

    Two-stage diagonally implicit Runge-Kutta (L-stable, second order). Each stage is one piecewise linear equation in
    the force.
    """
    k1, c1, k2 = solid[0], solid[1], solid[2]
    h = _SDIRK * dt
    kelvin, spring = state[0], state[1]
    slope = 1.0 / k2 + h / (c1 + k1 * h)
    first_kelvin, first_spring = kelvin, spring
    rate_kelvin, rate_spring = 0.0, 0.0
    for stage in range(2):
        if stage == 0:
            speed = first + _SDIRK * (last - first)
        else:
            speed = last
            first_kelvin = kelvin + (1.0 - _SDIRK) * dt * rate_kelvin
            first_spring = spring + (1.0 - _SDIRK) * dt * rate_spring
        right = first_spring + h * (speed + k1 * first_kelvin / (c1 + k1 * h))
        force = _stage_force(slope, right, h / viscosity, strength)
        rate_kelvin = (force - k1 * first_kelvin) / (c1 + k1 * h)
        rate_spring = (force / k2 - first_spring) / h
    state[0] = first_kelvin + h * rate_kelvin
    state[1] = first_spring + h * rate_spring


@njit(STEP_SIGNATURE, cache=True)
def gamota_filisko_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: k1, c1, k2 of the solid [N/m, N s/m, N/m]. State: Kelvin deformation, force/k2 [m], last velocity,
    last yield force, last viscosity.

    The damper yields within a few milliseconds after a reversal, so that a longer interval is divided. The velocity of
    the Bingham element replaces that of the rod.
    """
    v = wire[VELOCITY]
    wire[OUTER_VELOCITY] = v
    strength = max(wire[YIELD_FORCE], 0.0)
    viscosity = max(wire[VISCOSITY], 1e-12 * parameters[1])
    if wire[FIRST] > 0.5:
        state[0] = 0.0
        state[1] = 0.0
        state[2] = v
        state[3] = strength
        state[4] = viscosity
        wire[HYSTERESIS] = 0.0
        wire[VELOCITY] = 0.0
        return
    count = parts_of(dt)
    for part in range(count):
        begin, end = part / count, (part + 1.0) / count
        first = state[2] + begin * (v - state[2])
        last = state[2] + end * (v - state[2])
        held = state[3] + end * (strength - state[3])
        creep = state[4] + end * (viscosity - state[4])
        _advance(state, first, last, held, creep, dt / count, parameters)
    state[2] = v
    state[3] = strength
    state[4] = viscosity
    force = parameters[2] * state[1]
    excess = max(abs(force) - strength, 0.0)
    wire[HYSTERESIS] = min(max(force / strength, -1.0), 1.0) if strength > 0.0 else 0.0
    wire[VELOCITY] = math.copysign(excess / viscosity, force)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["solid_stiffness"], values["solid_viscosity"], values["spring_stiffness"]])
    return [Step("gamota-filisko", Phase.HYSTERESIS, gamota_filisko_step, numbers, 5), outer_velocity()]


FORM = BaseForm(
    name="gamota-filisko",
    summary="Bingham element in series with a Kelvin element (k1, c1) and a spring k2",
    source="Gamota and Filisko 1991, J. Rheol. 35, 399-425",
    parameters=(
        shape("solid_stiffness", "N/m", "k1", "force/stroke", 0.3, 3000.0, (30.0, 8.0)),
        shape("solid_viscosity", "N*s/m", "c1", "force/speed", 0.01, 1000.0, (1.0, 10.0)),
        shape("spring_stiffness", "N/m", "k2", "force/stroke", 0.5, 3000.0, (40.0, 10.0)),
    ),
    steps=_steps,
    coupled=True,
)
