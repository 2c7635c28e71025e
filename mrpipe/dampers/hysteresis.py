"""Bouc-Wen hysteresis in displacement increments, with closed-form updates for n = 1 and n = 2.

(2.2) divided by the velocity is an equation in displacement alone. With zeta = z/z_max, where z_max =
(A/(gamma + beta))^(1/n), the yield displacement x_y = z_max/A, the share of gamma g = gamma/(gamma + beta) and
y = sign(dx) zeta,

    dy/d(|x|/x_y) = 1 - |y|^n                  for y >= 0 (loading),
                    1 - (1 - 2 g) |y|^n         for y < 0  (unloading).

Both branches integrate to hyperbolic, circular or exponential functions for n = 2 and n = 1, so an update is exact for
a step of any length without a reversal. Other exponents are integrated by sub-stepped Runge-Kutta. The Dahl model is n
= 1, g = 1.
"""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.parameters import Parameter, Values, shape
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_FORCE, Phase, Step

SUB_STEP = 0.05
"""Longest sub-step of other exponents while unloading, in yield displacements; the update is then accurate to about
1e-7.
"""

LOADING_STEP = 0.1
"""Longest sub-step while loading far from yield, as a change of -log(1 - y), for the same accuracy."""

LONGEST_LOADING_STEP = 4.0
"""Longest sub-step of the same kind close to yield."""

YIELDED = 20.0
"""The damper counts as yielded if this is -log(1 - y)."""

LONGEST_PART_S = 1e-3
"""Longest part of an interval [s] over which the yield force of a form with a spring in series is taken as constant."""

MOST_PARTS = 4
"""Largest number of parts of an interval, which is sufficient for decimated records in a ranking of forms."""


# parameters that several base forms share
YIELD_DISPLACEMENT = shape(
    "yield_displacement", "m", "yield force over initial stiffness", "stroke", 1e-3, 2.0, (0.05, 0.15, 0.015)
)
GAMMA_SHARE = Parameter("gamma_share", "1", "gamma over gamma plus beta", "one", 0.02, 1.5, (0.5,))
EXPONENT = shape("exponent", "1", "n of (2.2)", "one", 1.0, 8.0, (1.9, 1.1))
INITIAL_STIFFNESS = shape(
    "initial_stiffness", "N/m", "stiffness before yield", "force/stroke", 0.3, 3000.0, (15.0, 5.0, 60.0)
)
SPRING_STIFFNESS = shape(
    "spring_stiffness", "N/m", "stiffness of the spring", "force/stroke", 0.5, 3000.0, (20.0, 5.0, 100.0)
)
HYSTERESIS_VELOCITY = Parameter("hysteresis_velocity", "m/s", "shift of the branches", "speed", 0.0, 0.5, (0.03, 0.1))
ACCELERATION_SCALE = shape(
    "acceleration_scale", "m/s^2", "acceleration over which the branches change", "acceleration", 1e-4, 1.0, (0.02,)
)


def bouc_wen_numbers(values: Values) -> tuple[float, float, float]:
    """Return yield displacement [m], share of gamma and exponent; gamma = beta and n = 2 are the defaults."""
    return values["yield_displacement"], values.get("gamma_share", 0.5), values.get("exponent", 2.0)


@njit(float64(float64, float64, float64), cache=True)
def _slope(y: float, exponent: float, unloading: float) -> float:
    if y >= 0.0:
        return 1.0 - y**exponent
    return 1.0 - unloading * (-y) ** exponent


@njit(float64(float64, float64), cache=True)
def _loading_rate(w: float, exponent: float) -> float:
    """Return dw/ds for w = -log(1 - y) and y >= 0."""
    rest = math.exp(-w)
    return (1.0 - max(1.0 - rest, 0.0) ** exponent) / rest


@njit(float64(float64, float64, float64, float64), cache=True)
def _advance_general(y: float, path: float, exponent: float, unloading: float) -> float:
    """Return y after a path by the Runge-Kutta method of order 4.

    While loading, the variable is w = -log(1 - y). Its rate changes slowly, also for a large exponent, where the rate
    of y changes within a small part of the path.
    """
    while y < 0.0 and path > 0.0:
        step = min(path, SUB_STEP)
        k1 = _slope(y, exponent, unloading)
        k2 = _slope(y + 0.5 * step * k1, exponent, unloading)
        k3 = _slope(y + 0.5 * step * k2, exponent, unloading)
        k4 = _slope(y + step * k3, exponent, unloading)
        y += step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
        path -= step
    if path <= 0.0:
        return y
    w = -math.log(max(1.0 - y, 1e-300))
    while path > 0.0 and w < YIELDED:
        k1 = _loading_rate(w, exponent)
        # close to yield the rate tends to the exponent, so that the steps can be long
        step = min(path, min(LOADING_STEP * (1.0 + math.exp(w) / exponent), LONGEST_LOADING_STEP) / k1)
        k2 = _loading_rate(w + 0.5 * step * k1, exponent)
        k3 = _loading_rate(w + 0.5 * step * k2, exponent)
        k4 = _loading_rate(w + step * k3, exponent)
        w += step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
        path -= step
    return 1.0 - math.exp(-w)


@njit(float64(float64, float64, float64), cache=True)
def _advance_square(y: float, path: float, unloading: float) -> float:
    # unloading branch up to y = 0, then the loading branch with the rest of the path
    if y < 0.0:
        root = math.sqrt(abs(unloading))
        if root < 1e-9:
            to_zero = -y
        elif unloading > 0.0:
            to_zero = math.atanh(min(-root * y, 1.0 - 1e-15)) / root
        else:
            to_zero = math.atan(-root * y) / root
        if path < to_zero:
            left = to_zero - path
            if root < 1e-9:
                return -left
            if unloading > 0.0:
                return -math.tanh(root * left) / root
            return -math.tan(root * left) / root
        path -= to_zero
        y = 0.0
    t = math.tanh(path)
    return (y + t) / (1.0 + y * t)


@njit(float64(float64, float64, float64), cache=True)
def _advance_linear(y: float, path: float, unloading: float) -> float:
    if y < 0.0:
        # dy/ds = 1 + unloading y
        flat = abs(unloading) < 1e-9
        to_zero = -y if flat else -math.log(max(1.0 + unloading * y, 1e-15)) / unloading
        if path < to_zero:
            if flat:
                return y + path
            return ((1.0 + unloading * y) * math.exp(unloading * path) - 1.0) / unloading
        path -= to_zero
        y = 0.0
    return 1.0 - (1.0 - y) * math.exp(-path)


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def advance_hysteresis(
    zeta: float, increment: float, yield_displacement: float, gamma_share: float, exponent: float
) -> float:
    """Return the normalised hysteretic variable after a motion of the rod by `increment` [m] without reversal.

    Parameters
    ----------
    zeta
        Normalised hysteretic variable before the increment, -1..1.
    increment
        Displacement of the step [m].
    yield_displacement
        x_y = z_max/A [m].
    gamma_share
        gamma/(gamma + beta).
    exponent
        n of (2.2).
    """
    if increment == 0.0:
        return zeta
    sign = 1.0 if increment > 0.0 else -1.0
    path = abs(increment) / yield_displacement
    y = sign * zeta
    unloading = 1.0 - 2.0 * gamma_share
    if exponent == 2.0:
        y = _advance_square(y, path, unloading)
    elif exponent == 1.0:
        y = _advance_linear(y, path, unloading)
    else:
        y = _advance_general(y, path, exponent, unloading)
    return sign * min(max(y, -1.0), 1.0)


@njit(float64(float64, float64, float64), cache=True)
def _square_part(mean: float, speed_before: float, speed_after: float) -> float:
    """Return b of the velocity between two samples, speed_before + a s + b s^2 with s from 0 to 1, of given mean."""
    return 3.0 * (speed_before + speed_after - 2.0 * mean)


@njit(float64(float64, float64, float64), cache=True)
def _linear_part(mean: float, speed_before: float, speed_after: float) -> float:
    """Return a of the velocity of :func:`_square_part`."""
    return 6.0 * mean - 4.0 * speed_before - 2.0 * speed_after


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def turning_share(before: float, speed_before: float, after: float, speed_after: float, dt: float) -> float:
    """Return the instant of the reversal between two samples, as a share of the interval; 1 if there is none.

    The cubic through both displacements and velocities (Hermite) describes the motion between the samples. Without the
    turning point, several per cent of the yield displacement would be missing from the path of a stiff hysteresis at
    every reversal, at a sampling rate of 250 Hz.

    Parameters
    ----------
    before, after
        Displacements at both samples [m].
    speed_before, speed_after
        Velocities at both samples [m/s].
    dt
        Time between the samples [s].
    """
    if speed_before * speed_after >= 0.0:
        return 1.0
    mean = (after - before) / dt
    # the velocity changes its sign once
    square = _square_part(mean, speed_before, speed_after)
    linear = _linear_part(mean, speed_before, speed_after)
    root = math.sqrt(max(linear * linear - 4.0 * square * speed_before, 0.0))
    # formula of the roots without cancellation (Press et al. 2007, Numerical Recipes, section 5.6)
    half = -0.5 * (linear + math.copysign(root, linear))
    share = speed_before / half
    if share < 0.0 or share > 1.0 + 1e-9:
        share = half / square
    return min(max(share, 1e-12), 1.0)


@njit(float64(float64, float64, float64, float64, float64, float64), cache=True)
def displacement_between(
    share: float, before: float, speed_before: float, after: float, speed_after: float, dt: float
) -> float:
    """Return the displacement at a share of the interval between two samples, on the cubic of :func:`turning_share`."""
    if share >= 1.0:
        return after
    mean = (after - before) / dt
    square = _square_part(mean, speed_before, speed_after)
    linear = _linear_part(mean, speed_before, speed_after)
    return before + dt * share * (speed_before + share * (0.5 * linear + share * square / 3.0))


@njit(int64(float64), cache=True)
def parts_of(dt: float) -> int:
    """Return the number of parts of an interval [s] over which yield force and strain change together."""
    return min(max(1, math.ceil(dt / LONGEST_PART_S - 1e-9)), MOST_PARTS)


@njit(float64(float64, float64, float64, float64, float64, float64, float64, float64, float64), cache=True)
def follow_hysteresis(
    zeta: float,
    before: float,
    speed_before: float,
    after: float,
    speed_after: float,
    dt: float,
    yield_displacement: float,
    gamma_share: float,
    exponent: float,
) -> float:
    """Return the normalised hysteretic variable at a sample, from that at the sample before it.

    The arguments are those of :func:`advance_hysteresis` and of :func:`turning_share`. The path includes the turning
    point of the motion.
    """
    share = turning_share(before, speed_before, after, speed_after, dt)
    turn = displacement_between(share, before, speed_before, after, speed_after, dt)
    at_turn = advance_hysteresis(zeta, turn - before, yield_displacement, gamma_share, exponent)
    return advance_hysteresis(at_turn, after - turn, yield_displacement, gamma_share, exponent)


@njit(STEP_SIGNATURE, cache=True)
def hysteresis_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: yield displacement [m], gamma share, exponent. State: last displacement [m], zeta, last velocity."""
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    if wire[FIRST] > 0.5:
        state[0] = x
        state[1] = 0.0
        state[2] = v
    length, share, power = parameters[0], parameters[1], parameters[2]
    state[1] = follow_hysteresis(state[1], state[0], state[2], x, v, dt, length, share, power)
    state[0] = x
    state[2] = v
    wire[HYSTERESIS] = state[1]


def hysteresis(yield_displacement: float, gamma_share: float = 0.5, exponent: float = 2.0) -> Step:
    """Return the Bouc-Wen hysteresis (2.2) as a step; see :func:`advance_hysteresis`."""
    numbers = np.array([yield_displacement, gamma_share, exponent], dtype=np.float64)
    return Step("hysteresis", Phase.HYSTERESIS, hysteresis_step, numbers, state_size=3)


@njit(STEP_SIGNATURE, cache=True)
def growing_hysteresis_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: yield displacement [m] at the reference force, gamma share, exponent, power, reference force [N].

    State: last displacement [m], zeta, last velocity [m/s].
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    if wire[FIRST] > 0.5:
        state[0] = x
        state[1] = 0.0
        state[2] = v
    # a tiny share of the reference keeps the yield displacement above zero if the damper has no yield force
    ratio = max(wire[YIELD_FORCE] / parameters[4], 1e-9)
    length = max(parameters[0] * ratio ** parameters[3], 1e-15)
    share, power = parameters[1], parameters[2]
    state[1] = follow_hysteresis(state[1], state[0], state[2], x, v, dt, length, share, power)
    state[0] = x
    state[2] = v
    wire[HYSTERESIS] = state[1]


def growing_hysteresis(
    yield_displacement: float, gamma_share: float, exponent: float, growth: float, reference_force: float
) -> Step:
    """Return the Bouc-Wen hysteresis with x_y = yield_displacement (F_y/reference_force)^growth [m], [N]."""
    numbers = np.array([yield_displacement, gamma_share, exponent, growth, reference_force], dtype=np.float64)
    return Step("growing-hysteresis", Phase.HYSTERESIS, growing_hysteresis_step, numbers, state_size=3)
