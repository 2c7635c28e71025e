"""A spring in series with a valve whose force is a monotone function of its flow velocity.

The oil, the hoses and the mounts of a damper are elastic, and the valve sees only the part of the motion that they do
not take. With the deformation e of the spring and the velocity q of the valve,

    k e = H(q; F_y, c0),    e' = v - q,

where H is the Herschel-Bulkley law F_y (q/v0)/(1 + |q/v0|^m)^(1/m) + c0 q (s/v_ref)^(n - 1), s = sqrt(q^2 + v0^2), or
Eyring's law F_y asinh(q/v0)/asinh(v_ref/v0) + c0 q. The sharpness m of the yield point is free, because another
rounding than that of the damper leaves an error that is similar to friction at low speed. Source: Sims, Peel, Stanway,
Johnson, Bullough 2000, J. Sound Vib. 229, 207-227 (a quasi-steady valve in series with a spring).

The equation is stiff, because the valve hardly moves below the yield force. The two-stage diagonally implicit
Runge-Kutta method of second order (Alexander 1977, SIAM J. Numer. Anal. 14, 1006-1021) is L-stable. Each stage is one
equation for q.
"""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.hysteresis import displacement_between, parts_of
from mrpipe.dampers.plant import (
    DISPLACEMENT,
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
from mrpipe.dampers.viscoplastic import knee

HERSCHEL_BULKLEY = 0
EYRING = 1

_SDIRK = 1.0 - math.sqrt(0.5)
"""Coefficient of the Runge-Kutta method."""

_MOST_ITERATIONS = 60
"""Numerical technique: most iterations for the velocity of the valve; usually about four are needed."""

_LAST_STEP = 1e-4
"""Numerical technique: last step of the iterations, relative to the velocity plus the velocity scale."""


@njit(float64(int64, float64, float64, float64, float64), cache=True)
def yield_share(law: int, q: float, scale: float, reference: float, sharpness: float) -> float:
    """Return the factor of F_y in the force of the valve at the velocity `q` [m/s]."""
    if law == EYRING:
        return math.asinh(q / scale) / math.asinh(reference / scale)
    if sharpness == 2.0:
        return q / math.sqrt(q * q + scale * scale)
    return knee(q / scale, sharpness)


@njit(float64(int64, float64, float64, float64, float64), cache=True)
def viscous_velocity(law: int, q: float, scale: float, reference: float, power: float) -> float:
    """Return the factor of c0 in the force of the valve at the velocity `q` [m/s]."""
    if law == EYRING or power == 1.0:
        return q
    return q * (math.sqrt(q * q + scale * scale) / reference) ** (power - 1.0)


@njit(float64(int64, float64, float64, float64, float64, float64, float64, float64, float64, float64), cache=True)
def flow_velocity(
    law: int,
    load: float,
    weight: float,
    start: float,
    strength: float,
    viscosity: float,
    scale: float,
    reference: float,
    power: float,
    sharpness: float,
) -> float:
    """Return q of H(q) + weight q = load; Newton's method within an interval that always holds the solution.

    Parameters
    ----------
    law, strength, viscosity, scale, reference, power, sharpness
        The valve; `strength` is F_y, for Eyring's law F_y/asinh(v_ref/v0) [N].
    load
        Right side [N].
    weight
        Slope of the linear part [N s/m], above 0.
    start
        First guess [m/s].
    """
    sign = 1.0 if load > 0.0 else -1.0
    load = abs(load)
    low, high = 0.0, load / weight
    q = min(max(sign * start, low), high)
    for _ in range(_MOST_ITERATIONS):
        square = q * q + scale * scale
        rounded = math.sqrt(square)
        if law == EYRING:
            force = strength * math.log((q + rounded) / scale) + viscosity * q
            slope = strength / rounded + viscosity
        else:
            thinning = viscosity if power == 1.0 else viscosity * (rounded / reference) ** (power - 1.0)
            if sharpness == 2.0:
                plastic, rise = q / rounded, scale * scale / (square * rounded)
            elif q <= scale:
                # both branches are the function `knee` and its slope; each avoids an overflow of the power
                growing = 1.0 + (q / scale) ** sharpness
                rise = growing ** (-1.0 / sharpness) / scale
                plastic = rise * q
                rise /= growing
            else:
                falling = (scale / q) ** sharpness
                plastic = (1.0 + falling) ** (-1.0 / sharpness)
                rise = plastic * falling / (q * (1.0 + falling))
            force = strength * plastic + thinning * q
            slope = strength * rise + thinning * (1.0 + (power - 1.0) * q * q / square)
        excess = force + weight * q - load
        if excess > 0.0:
            high = q
        else:
            low = q
        after = q - excess / (slope + weight)
        if after < low or after > high:
            q = 0.5 * (low + high)
            continue
        change = abs(after - q)
        q = after
        # the error after a step of Newton's method is the square of the step, relative to the scale of the law; a
        # bisection leaves an error as large as its step
        if change <= _LAST_STEP * (q + scale):
            break
    return sign * q


@njit(STEP_SIGNATURE, cache=True)
def series_valve_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: law, stiffness [N/m], velocity scale [m/s], reference velocity [m/s], exponent, sharpness. State:
    last displacement [m], deformation of the spring [m], last velocity [m/s], last yield force [N], last viscosity
    [N s/m], last velocity of the valve [m/s].

    The velocity of the valve, raised to its exponent, replaces that of the rod. A long interval is divided, because the
    yield force can change while the spring is strained.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    wire[OUTER_VELOCITY] = v
    law, stiffness = int(parameters[0]), parameters[1]
    scale, reference, power, sharpness = parameters[2], parameters[3], parameters[4], parameters[5]
    strength, viscosity = max(wire[YIELD_FORCE], 0.0), max(wire[VISCOSITY], 0.0)
    if wire[FIRST] > 0.5:
        state[0] = x
        state[1] = 0.0
        state[2] = v
        state[3] = strength
        state[4] = viscosity
        state[5] = 0.0
    parts = parts_of(dt)
    h = dt / parts
    place, e, q = state[0], state[1], state[5]
    weight = stiffness * _SDIRK * h
    norm = 1.0 / math.asinh(reference / scale) if law == EYRING else 1.0
    for part in range(parts):
        middle, end = (part + _SDIRK) / parts, (part + 1.0) / parts
        after = displacement_between(end, state[0], state[2], x, v, dt)
        # the velocity of the first stage makes the sum over both stages the displacement
        final = state[2] + end * (v - state[2])
        speed = ((after - place) / h - _SDIRK * final) / (1.0 - _SDIRK)
        limit = norm * (state[3] + middle * (strength - state[3]))
        thick = state[4] + middle * (viscosity - state[4])
        first = flow_velocity(
            law, stiffness * (e + _SDIRK * h * speed), weight, q, limit, thick, scale, reference, power, sharpness
        )
        limit = norm * (state[3] + end * (strength - state[3]))
        thick = state[4] + end * (viscosity - state[4])
        load = e + after - place - (1.0 - _SDIRK) * h * first
        q = flow_velocity(law, stiffness * load, weight, first, limit, thick, scale, reference, power, sharpness)
        e = load - _SDIRK * h * q
        place = after
    state[0] = x
    state[1] = e
    state[2] = v
    state[3] = strength
    state[4] = viscosity
    state[5] = q
    wire[HYSTERESIS] = yield_share(law, q, scale, reference, sharpness)
    wire[VELOCITY] = viscous_velocity(law, q, scale, reference, power)


def series_valve(
    law: int,
    stiffness: float,
    velocity_scale: float,
    reference_velocity: float,
    exponent: float = 1.0,
    sharpness: float = 2.0,
) -> Step:
    """Return the spring in series with a valve as a step.

    Parameters
    ----------
    law
        `HERSCHEL_BULKLEY` or `EYRING`.
    stiffness
        Stiffness of the spring [N/m].
    velocity_scale
        v0 [m/s]: velocity at which the valve yields.
    reference_velocity
        v_ref [m/s]: velocity for which F_y (Eyring) or c0 (Herschel-Bulkley) is given.
    exponent
        n of Herschel and Bulkley; 1 is Bingham's law.
    sharpness
        m of the yield point of Herschel and Bulkley; 2 is a square root.
    """
    numbers = np.array([law, stiffness, velocity_scale, reference_velocity, exponent, sharpness], dtype=np.float64)
    return Step("series-valve", Phase.HYSTERESIS, series_valve_step, numbers, state_size=6)
