"""Steps for a yield force that depends on speed: sign of the velocity, powers of the speed, spring and dashpot.

On recordings of real dampers these forms lower the error more than any other refinement of the Bouc-Wen model, because
the force of a real damper continues to rise with speed, first steeply and then less.
"""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    DISPLACEMENT,
    FIRST,
    FORCE,
    HYSTERESIS,
    OUTER_VELOCITY,
    RATE_YIELD,
    STEP_SIGNATURE,
    VELOCITY,
    Phase,
    Step,
)

_SDIRK = 1.0 - math.sqrt(0.5)

_LAST_STEP = 1e-5
"""Numerical technique: last step of the iterations for theta."""


@njit(float64(float64, float64), cache=True)
def rounded_sign(velocity: float, scale: float) -> float:
    """Return tanh(velocity/scale), and sign(velocity) for a scale of 0."""
    if scale > 0.0:
        return math.tanh(velocity / scale)
    if velocity > 0.0:
        return 1.0
    if velocity < 0.0:
        return -1.0
    return 0.0


@njit(STEP_SIGNATURE, cache=True)
def sign_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: transition velocity [m/s]."""
    wire[HYSTERESIS] = rounded_sign(wire[VELOCITY], parameters[0])


@njit(float64(float64, float64), cache=True)
def knee(ratio: float, sharpness: float) -> float:
    """Return r/(1 + |r|^n)^(1/n): a square root for n = 2, close to a hyperbolic tangent for n = 2.7, a sharp knee for
    large n (Ramberg and Osgood 1943)."""
    size = abs(ratio)
    # both branches are the same function; each avoids an overflow of the power
    if size <= 1.0:
        return ratio / (1.0 + size**sharpness) ** (1.0 / sharpness)
    return math.copysign(1.0 / (1.0 + size ** (-sharpness)) ** (1.0 / sharpness), ratio)


def velocity_sign(transition_velocity: float = 0.0) -> Step:
    """Return the sign of the velocity in (6.1); with a transition velocity [m/s] above 0 it is a tanh."""
    return Step("velocity-sign", Phase.HYSTERESIS, sign_step, np.array([float(transition_velocity)]))


@njit(STEP_SIGNATURE, cache=True)
def power_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: reference velocity [m/s], exponent."""
    wire[RATE_YIELD] *= (abs(wire[VELOCITY]) / parameters[0]) ** parameters[1]


def power_of_velocity(reference_velocity: float, exponent: float) -> Step:
    """Return the factor (|v|/v_ref)^p on the yield force: 1 at the reference velocity [m/s]."""
    numbers = np.array([reference_velocity, exponent], dtype=np.float64)
    return Step("power-of-velocity", Phase.COEFFICIENT_EFFECT, power_step, numbers)


@njit(STEP_SIGNATURE, cache=True)
def outer_velocity_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Restore the velocity of the rod on the wire after that of an inner element."""
    wire[VELOCITY] = wire[OUTER_VELOCITY]


def outer_velocity() -> Step:
    """Return the step that ends the part of a chain in which the wire has the velocity of an inner element."""
    return Step("outer-velocity", Phase.FORCE_EFFECT, outer_velocity_step, np.zeros(0))


@njit(STEP_SIGNATURE, cache=True)
def parallel_spring_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: stiffness [N/m]."""
    wire[FORCE] += parameters[0] * wire[DISPLACEMENT]


def parallel_spring(stiffness: float) -> Step:
    """Return a spring [N/m] parallel to the damper."""
    return Step("parallel-spring", Phase.FORCE_EFFECT, parallel_spring_step, np.array([float(stiffness)]))


@njit(float64(float64, float64, float64), cache=True)
def _solve_stage(weight: float, right: float, start: float) -> float:
    """Return theta with tanh(theta) + weight theta = right; Newton from the side where it cannot overshoot."""
    theta = start
    for _ in range(60):
        t = math.tanh(theta)
        residual = t + weight * theta - right
        slope = 1.0 - t * t + weight
        change = residual / slope
        limit = 1.0 + abs(theta)
        change = min(max(change, -limit), limit)
        theta -= change
        # the error after a step of Newton's method is the square of the step
        if abs(change) < _LAST_STEP:
            break
    return theta


@njit(float64(float64, float64, float64, float64, float64, float64), cache=True)
def advance_dashpot(
    theta: float, previous: float, present: float, dt: float, stiffness: float, velocity_scale: float
) -> float:
    """Return atanh(z) after `dt` [s] of z' = q (v - v0 atanh z).

    A spring of q [1/m] in series with a dashpot that saturates: z = tanh(v/v0) in the steady state. Two-stage
    diagonally implicit Runge-Kutta (L-stable, second order); the velocity is linear from `previous` to `present`.
    """
    gain = stiffness * dt
    weight = _SDIRK * gain * velocity_scale
    first_velocity = previous + _SDIRK * (present - previous)
    z0 = math.tanh(theta)
    first = _solve_stage(weight, z0 + _SDIRK * gain * first_velocity, theta)
    rate = gain * (first_velocity - velocity_scale * first)
    return _solve_stage(weight, z0 + (1.0 - _SDIRK) * rate + _SDIRK * gain * present, first)


@njit(float64(float64[::1], float64[::1], float64, float64, float64), cache=True)
def follow_dashpot(wire: FloatArray, state: FloatArray, stiffness: float, velocity_scale: float, dt: float) -> float:
    """Return z of :func:`advance_dashpot` at the velocity on the wire. State: atanh z, last velocity."""
    if wire[FIRST] > 0.5:
        state[0] = 0.0
    else:
        state[0] = advance_dashpot(state[0], state[1], wire[VELOCITY], dt, stiffness, velocity_scale)
    state[1] = wire[VELOCITY]
    return math.tanh(state[0])


@njit(STEP_SIGNATURE, cache=True)
def dashpot_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: q [1/m], velocity scale v0 [m/s]. State: atanh z, last velocity."""
    wire[HYSTERESIS] = follow_dashpot(wire, state, parameters[0], parameters[1], dt)


def saturating_dashpot(stiffness: float, velocity_scale: float) -> Step:
    """Return the spring in series with a saturating dashpot, see :func:`advance_dashpot`."""
    numbers = np.array([stiffness, velocity_scale], dtype=np.float64)
    return Step("saturating-dashpot", Phase.HYSTERESIS, dashpot_step, numbers, state_size=2)
