"""General Duhem hysteresis: the slope of the loop is a free function of the hysteretic force."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import YIELD_DISPLACEMENT, displacement_between, turning_share
from mrpipe.dampers.parameters import Parameter, Values, shape
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step

LONGEST = 0.2
"""Longest step of the integration, as a change of w and of the logarithm of its rate together."""

YIELDED = 16.0
"""The damper counts as yielded if this is w: its force is then within 1e-7 of the yield force."""


@njit(float64(float64, float64, float64, float64), cache=True)
def _rate(w: float, power: float, tilt: float, curvature: float) -> float:
    """Return dw/ds for w = -log(1 - y)."""
    y = 1.0 - math.exp(-w)
    return math.exp(y * (tilt + curvature * y) - (power - 1.0) * w)


@njit(float64(float64, float64, float64[::1]), cache=True)
def _advanced(zeta: float, increment: float, parameters: FloatArray) -> float:
    """Return the normalised force after a motion by `increment` [m] without reversal (Runge-Kutta, order 4).

    The variable is w = -log(1 - y). Its rate changes slowly where y approaches 1, so that few steps are sufficient.
    """
    if increment == 0.0:
        return zeta
    sign = 1.0 if increment > 0.0 else -1.0
    y = sign * zeta
    power, tilt, curvature = parameters[1], parameters[2], parameters[3]
    path = abs(increment) / parameters[0]
    w = -math.log(max(1.0 - y, 1e-300))
    while path > 0.0 and w < YIELDED:
        k1 = _rate(w, power, tilt, curvature)
        rest = math.exp(-w)
        bend = (tilt + 2.0 * curvature * (1.0 - rest)) * rest - (power - 1.0)
        step = min(path, LONGEST / (k1 * (1.0 + abs(bend))))
        k2 = _rate(w + 0.5 * step * k1, power, tilt, curvature)
        k3 = _rate(w + 0.5 * step * k2, power, tilt, curvature)
        k4 = _rate(w + step * k3, power, tilt, curvature)
        w += step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
        path -= step
    return sign * (1.0 - math.exp(-w))


@njit(STEP_SIGNATURE, cache=True)
def duhem_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: yield displacement [m], power, tilt, curvature. State: last displacement [m], normalised force, last
    velocity [m/s].
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    if wire[FIRST] > 0.5:
        state[0] = x
        state[1] = 0.0
        state[2] = v
    share = turning_share(state[0], state[2], x, v, dt)
    turn = displacement_between(share, state[0], state[2], x, v, dt)
    at_turn = _advanced(state[1], turn - state[0], parameters)
    state[1] = _advanced(at_turn, x - turn, parameters)
    state[0] = x
    state[2] = v
    wire[HYSTERESIS] = state[1]


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values[name] for name in ("yield_displacement", "power", "tilt", "curvature")])
    return [Step("duhem", Phase.HYSTERESIS, duhem_step, numbers, state_size=3)]


FORM = BaseForm(
    name="duhem",
    summary="dy/d(|x|/x_y) = (1 - y)^p exp(a y + b y^2), y = z sign v: Bouc-Wen loops, Dahl loops and loops in between",
    source="Visintin 1994, Differential Models of Hysteresis, chapter V (Duhem); Dahl 1976, AIAA J. 14, 1675-1682 "
    "(p free, a = b = 0)",
    parameters=(
        YIELD_DISPLACEMENT,
        shape("power", "1", "p: above 1 the force approaches its limit more slowly", "one", 0.3, 4.0, (1.2,)),
        Parameter(
            "tilt",
            "1",
            "a: positive if the loop is steeper before yield than after a reversal",
            "one",
            -1.5,
            2.0,
            (0.3,),
        ),
        Parameter("curvature", "1", "b", "one", -1.0, 1.0, (0.0,)),
    ),
    steps=_steps,
    family="bouc-wen",
)
