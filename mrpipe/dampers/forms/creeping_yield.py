"""Bouc-Wen hysteresis that creeps under load."""

from __future__ import annotations

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Parameter, Values, shape
from mrpipe.dampers.plant import FIRST, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.dampers.rosenbrock import damping_factor, parts_of_step


@njit(float64(float64, float64, float64[::1]), cache=True)
def creep_rate(z: float, v: float, parameters: FloatArray) -> float:
    """Return z' [1/s]; parameters as in :func:`creeping_step`."""
    size = abs(z)
    ratio = parameters[3]
    bends = ratio * abs(v) * z * size + (1.0 - ratio) * v * size * size
    creeps = parameters[1] * size ** parameters[2] * (1.0 if z > 0.0 else -1.0)
    return parameters[0] * (v - bends - creeps)


@njit(float64(float64, float64, float64[::1]), cache=True)
def creep_slope(z: float, v: float, parameters: FloatArray) -> float:
    """Return the derivative of z' by z [1/s]."""
    size = abs(z)
    ratio = parameters[3]
    bends = 2.0 * ratio * abs(v) * size + 2.0 * (1.0 - ratio) * v * z
    creeps = parameters[1] * parameters[2] * size ** (parameters[2] - 1.0)
    return -parameters[0] * (bends + creeps)


@njit(STEP_SIGNATURE, cache=True)
def creeping_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: spring rate [1/m], creep speed [m/s], exponent, gamma over gamma plus beta. State: z, last velocity.

    Bouc-Wen's z (2.2) with n = 2, minus the creep under load. The equation is stiff if the spring is stiff, so it is
    integrated by the Rosenbrock method of second order of :mod:`mrpipe.dampers.rosenbrock`.
    """
    if wire[FIRST] > 0.5:
        state[0] = 0.0
        state[1] = wire[VELOCITY]
        wire[HYSTERESIS] = 0.0
        return
    first, change = state[1], wire[VELOCITY] - state[1]
    fastest = parameters[0] * (2.0 * max(abs(first), abs(wire[VELOCITY])) + parameters[1] * parameters[2])
    parts = parts_of_step(fastest, dt)
    h, z = dt / parts, state[0]
    for k in range(parts):
        v0, v1 = first + change * k / parts, first + change * (k + 1) / parts
        factor = damping_factor(h, creep_slope(z, 0.5 * (v0 + v1), parameters))
        k1 = factor * creep_rate(z, v0, parameters)
        trial = min(max(z + h * k1, -1.0), 1.0)
        k2 = factor * (creep_rate(trial, v1, parameters) - 2.0 * k1)
        z = min(max(z + h * (1.5 * k1 + 0.5 * k2), -1.0), 1.0)
    state[0] = z
    state[1] = wire[VELOCITY]
    wire[HYSTERESIS] = z


def creeping(spring_rate: float, creep_speed: float, exponent: float, gamma_share: float) -> Step:
    """Return the creeping hysteresis: spring rate [1/m], creep speed at the full force [m/s], exponent, gamma share."""
    numbers = np.array([spring_rate, creep_speed, exponent, gamma_share], dtype=np.float64)
    return Step("creeping", Phase.HYSTERESIS, creeping_step, numbers, 2)


def _steps(values: Values) -> list[Step]:
    return [creeping(values["elastic_rate"], values["creep_speed"], values["creep_exponent"], values["gamma_share"])]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    # steady state of z: v (1 - z^2) = v_c z^m, a monotone equation, solved by bisection
    speed, creep, power = at.speed, values["creep_speed"], values["creep_exponent"]
    low, high = np.zeros_like(speed), np.ones_like(speed)
    for _ in range(40):
        middle = 0.5 * (low + high)
        rising = speed * (1.0 - middle**2) > creep * middle**power
        low, high = np.where(rising, middle, low), np.where(rising, high, middle)
    return rounded_sum(0.5 * (low + high), at)


FORM = BaseForm(
    name="creeping-yield",
    summary="z' = q (v - r |v| z |z| - (1 - r) v z^2 - v_c |z|^m sign z): Bouc-Wen that creeps after Norton's law",
    source="Norton 1929, The Creep of Steel at High Temperatures (power law); Wen 1976",
    parameters=(
        shape("elastic_rate", "1/m", "stiffness over the yield force", "one/stroke", 2.0, 500.0, (10.0, 40.0)),
        shape("creep_speed", "m/s", "creep under the full force", "speed", 2e-3, 2.0, (0.03, 0.2)),
        shape("creep_exponent", "1", "exponent of the force in the creep law", "one", 1.0, 20.0, (3.0,)),
        Parameter("gamma_share", "1", "gamma over gamma plus beta", "one", 0.0, 1.0, (0.5,)),
    ),
    steps=_steps,
    post_yield=_post_yield,
    family="rate-dependent-yield",
)
