"""The modified Bouc-Wen model of Spencer et al. (P4 (1) to (5)): a dashpot c1 in series, springs k0 and k1.

With w = x - y the inner equation reads (c0 + c1) w' = c1 x' - alpha z(w) - k0 w, and the force is alpha z + c0 w' + k0
w + k1 (x - x0), which is (1) again. z is a rate-independent function of w with a closed form, so a step solves one
monotone scalar equation. It is the trapezoidal rule in w, which is stable for any stiffness.
"""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.hysteresis import advance_hysteresis
from mrpipe.dampers.plant import (
    CURRENT,
    DISPLACEMENT,
    EXTRA_FORCE,
    FIRST,
    FORCE,
    HYSTERESIS,
    INNER_DISPLACEMENT,
    OUTER_VELOCITY,
    RATE_YIELD,
    STEP_SIGNATURE,
    VELOCITY,
    VISCOSITY,
    YIELD_FORCE,
    Phase,
    Step,
)

MOST_ITERATIONS = 80
"""Numerical technique: most iterations for the motion of the inner element; usually about four are needed."""

LEAST_VISCOSITY = 1e-9
"""Numerical technique: least viscosity of the dashpot in series [N s/m]. An overshoot of the drive below zero may make
both viscosities zero, and the motion of the inner element would then be a division by zero."""

LAST_STEP = 1e-5
"""Numerical technique: last step of the iterations, relative to the yield displacement."""


@njit(
    float64(float64, float64, float64, float64, float64, float64, float64, float64, float64, float64, float64),
    cache=True,
)
def inner_increment(
    w: float,
    zeta: float,
    increment: float,
    dt: float,
    yield_force: float,
    viscosity: float,
    series_viscosity: float,
    stiffness: float,
    yield_displacement: float,
    gamma_share: float,
    exponent: float,
) -> float:
    """Return the change of w [m] while the rod moves by `increment` [m] in `dt` [s].

    The residual grows with the change at a rate of at least c0 + c1, so bracketed Newton steps always converge.
    """
    total = viscosity + series_viscosity
    impulse = series_viscosity * increment

    low = impulse - dt * (yield_force * 0.5 * (1.0 + zeta) + stiffness * w)
    high = impulse + dt * (yield_force * 0.5 * (1.0 - zeta) - stiffness * w)
    low = low / (total + 0.5 * dt * stiffness)
    high = high / (total + 0.5 * dt * stiffness)
    # the tangent at the present state is a first estimate, which is exact if the hysteresis has yielded
    direction = 1.0 if impulse - dt * (yield_force * zeta + stiffness * w) >= 0.0 else -1.0
    y = direction * zeta
    start = (1.0 - y**exponent if y >= 0.0 else 1.0 - (1.0 - 2.0 * gamma_share) * (-y) ** exponent) / yield_displacement
    slope = total + 0.5 * dt * (yield_force * max(start, 0.0) + stiffness)
    change = min(max((impulse - dt * (yield_force * zeta + stiffness * w)) / slope, low), high)
    for _ in range(MOST_ITERATIONS):
        moved = advance_hysteresis(zeta, change, yield_displacement, gamma_share, exponent)
        residual = total * change - impulse + dt * (yield_force * 0.5 * (zeta + moved) + stiffness * (w + 0.5 * change))
        if residual > 0.0:
            high = change
        else:
            low = change
        direction = 1.0 if change >= 0.0 else -1.0
        y = direction * moved
        slope_zeta = (
            1.0 - y**exponent if y >= 0.0 else 1.0 - (1.0 - 2.0 * gamma_share) * (-y) ** exponent
        ) / yield_displacement
        slope = total + 0.5 * dt * (yield_force * max(slope_zeta, 0.0) + stiffness)
        trial = change - residual / slope
        if trial < low or trial > high:
            change = 0.5 * (low + high)
            continue
        moved_by = abs(trial - change)
        change = trial
        # the error after a step of Newton's method is the square of the step, relative to the yield displacement
        if moved_by <= LAST_STEP * yield_displacement:
            break
    return change


@njit(STEP_SIGNATURE, cache=True)
def series_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Replace the velocity on the wire by w', and write zeta(w) to the wire.

    Parameters: yield displacement, gamma share, exponent, c1_a, c1_b [N s/m, per A or V], k0 [N/m].
    State: last displacement, w, zeta.
    """
    wire[OUTER_VELOCITY] = wire[VELOCITY]
    if wire[FIRST] > 0.5:
        state[0] = wire[DISPLACEMENT]
        state[1] = 0.0
        state[2] = 0.0
    series_viscosity = max(parameters[3] + parameters[4] * wire[CURRENT], LEAST_VISCOSITY)
    yield_force = max(wire[YIELD_FORCE] * wire[RATE_YIELD], 0.0)
    viscosity = max(wire[VISCOSITY], 0.0)
    change = inner_increment(
        state[1],
        state[2],
        wire[DISPLACEMENT] - state[0],
        dt,
        yield_force,
        viscosity,
        series_viscosity,
        parameters[5],
        parameters[0],
        parameters[1],
        parameters[2],
    )
    state[0] = wire[DISPLACEMENT]
    state[1] += change
    state[2] = advance_hysteresis(state[2], change, parameters[0], parameters[1], parameters[2])
    wire[HYSTERESIS] = state[2]
    wire[INNER_DISPLACEMENT] = state[1]
    inner = series_viscosity * wire[VELOCITY] - yield_force * state[2] - parameters[5] * state[1]
    wire[VELOCITY] = inner / (viscosity + series_viscosity)


@njit(STEP_SIGNATURE, cache=True)
def inner_spring_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: k0 [N/m]. Restores the velocity of the rod on the wire."""
    force = parameters[0] * wire[INNER_DISPLACEMENT]
    wire[EXTRA_FORCE] += force
    wire[FORCE] += force
    wire[VELOCITY] = wire[OUTER_VELOCITY]


@njit(STEP_SIGNATURE, cache=True)
def outer_spring_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: k1 [N/m], x0 [m]."""
    wire[FORCE] += parameters[0] * (wire[DISPLACEMENT] - parameters[1])


def series_dashpot(
    yield_displacement: float,
    gamma_share: float,
    exponent: float,
    series_viscosity: tuple[float, float],
    inner_stiffness: float,
    outer_stiffness: float = 0.0,
    rest_displacement: float = 0.0,
) -> list[Step]:
    """Return the steps of the modified Bouc-Wen model (P4): hysteresis with c1 and k0, and the force of each spring.

    Parameters
    ----------
    yield_displacement, gamma_share, exponent
        As in :func:`mrpipe.dampers.hysteresis.hysteresis`.
    series_viscosity
        c1_a [N s/m], c1_b [N s/m per A or V].
    inner_stiffness, outer_stiffness
        k0, k1 [N/m].
    rest_displacement
        x0 [m].
    """
    inner = np.array([yield_displacement, gamma_share, exponent, *series_viscosity, inner_stiffness])
    outer = np.array([outer_stiffness, rest_displacement])
    return [
        Step("series-dashpot", Phase.HYSTERESIS, series_step, inner, state_size=3),
        Step("inner-spring", Phase.FORCE_EFFECT, inner_spring_step, np.array([inner_stiffness])),
        Step("outer-spring", Phase.FORCE_EFFECT, outer_spring_step, outer),
    ]
