"""Heating: dissipated work warms the fluid, which lowers yield force and viscosity."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import float64, njit, void

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    FIRST,
    RATE_YIELD,
    STEP_SIGNATURE,
    VISCOSITY,
    WORK,
    Phase,
    Step,
    change_yield_force,
)
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Separation, Values, shape, strength


@njit(void(float64[::1], float64[::1], float64, float64), cache=True)
def _warm(wire: FloatArray, state: FloatArray, cooling_rate: float, dt: float) -> None:
    """Advance the heat [J] by the work of a step minus cooling at a rate [1/s], and store the work."""
    if wire[FIRST] > 0.5:
        state[0] = 0.0
        state[1] = wire[WORK]
    state[0] = state[0] * math.exp(-cooling_rate * dt) + wire[WORK] - state[1]
    state[1] = wire[WORK]


@njit(STEP_SIGNATURE, cache=True)
def heating_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: loss for each joule, cooling rate [1/s], kind (0 both, 1 yield, 2 viscosity), law (0, 1).

    State: heat [J], last work [J]. The heat follows from the simulated force, never from a measured one.
    """
    _warm(wire, state, parameters[1], dt)
    loss = parameters[0] * state[0]
    factor = math.exp(-min(max(loss, -5.0), 20.0)) if parameters[3] == 0.0 else 1.0 / max(1.0 + loss, 0.05)
    if parameters[2] != 2.0:
        change_yield_force(wire, factor)
    if parameters[2] != 1.0:
        wire[VISCOSITY] *= factor


@njit(STEP_SIGNATURE, cache=True)
def warming_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: loss for each joule, cooling rate [1/s], curvature p, exponent of the viscosity n, place (0, 1).

    State: heat [J], last work [J]. The yield force falls by (1 - p b Q)^(1/p), linearly at p = 1 and exponentially at
    p = 0; the viscosity by the same factor to the power n. Place 0: the yield force falls before the damper yields;
    1: the yield displacement does not change.
    """
    _warm(wire, state, parameters[1], dt)
    loss = min(max(parameters[0] * state[0], -5.0), 20.0)
    curvature = parameters[2]
    flat = abs(curvature) < 1e-3
    factor = math.exp(-loss) if flat else max(1.0 - curvature * loss, 0.02) ** (1.0 / curvature)
    factor = min(max(factor, 1e-3), 1e3)
    if parameters[4] == 0.0:
        change_yield_force(wire, factor)
    else:
        # the stiffness before the yield then falls with the yield force
        wire[RATE_YIELD] *= factor
    wire[VISCOSITY] *= factor ** parameters[3]


def _step(loss: float, rate: float, kind: float, law: float = 0.0) -> list[Step]:
    return [Step("heating", Phase.COEFFICIENT_EFFECT, heating_step, np.array([loss, rate, kind, law]), 2)]


def _adiabatic(values: Values) -> list[Step]:
    return _step(values["loss"], 0.0, 0.0)


def _cooling(values: Values) -> list[Step]:
    return _step(values["loss"], 1.0 / values["cooling_time"], 0.0)


def _yield(values: Values) -> list[Step]:
    return _step(values["loss"], 1.0 / values["cooling_time"], 1.0)


def _viscosity(values: Values) -> list[Step]:
    return _step(values["loss"], 1.0 / values["cooling_time"], 2.0)


def _rational(values: Values) -> list[Step]:
    return _step(values["loss"], 0.0, 1.0, 1.0)


def _warming(place: float) -> Callable[[Values], list[Step]]:
    def steps(values: Values) -> list[Step]:
        rate, power = 1.0 / values["cooling_time"], values["viscosity_exponent"]
        numbers = np.array([values["loss"], rate, values["curvature"], power, place])
        return [Step("heating", Phase.COEFFICIENT_EFFECT, warming_step, numbers, 2)]

    return steps


_LOSS = strength("loss", "1/J", "share of the force lost for each joule", "one/force/speed/time", 0.0, 8.0, 0.03)
_TIME = shape("cooling_time", "s", "time constant of cooling", "time", 0.1, 30.0, (0.6, 4.0))

_WARMING = (
    _LOSS,
    shape("cooling_time", "s", "time constant of cooling", "time", 0.1, 100.0, (4.0,)),
    Parameter("curvature", "1", "1: linear, 0: exponential", "one", -3.0, 2.0, (0.3,)),
    Parameter("viscosity_exponent", "1", "1: viscosity falls as the yield force", "one", 0.0, 5.0, (1.5,)),
)

EFFECT = Effect(
    name="heating",
    summary="forces fall as work is dissipated within a test",
    physics="The dissipated heat stays in the fluid for minutes; in a warm fluid the viscosity is lower and the "
    "particle chains are weaker.",
    remedy="Measure the temperature, pause between tests, and repeat the first test at the end.",
    residual="Proportional to the force, grows with the dissipated work within a test, and starts from zero after a "
    "pause.",
    source="Dogruoz et al. 2003; Wilson and Wereley 2013 on temperature of MR dampers",
    acts_on="yield force",
    forms=(
        EffectForm("adiabatic", "alpha, c exp(-b W)", (_LOSS,), _adiabatic),
        EffectForm("cooling", "alpha, c exp(-b Q), Q' = P - Q/tau", (_LOSS, _TIME), _cooling),
        EffectForm("yield-only", "alpha exp(-b Q)", (_LOSS, _TIME), _yield),
        EffectForm("viscosity-only", "c exp(-b Q)", (_LOSS, _TIME), _viscosity),
        EffectForm("rational", "alpha/(1 + b W)", (_LOSS,), _rational),
    ),
    separated_by={
        "offset": Separation("a long run, a pause for cooling, a repeat", ("long",)),
        "migration": Separation("a long run with a pause for cooling", ("long",)),
    },
    refinements=(
        EffectForm("curved", "alpha g, c g^n, g = (1 - p b Q)^(1/p), Q' = P - Q/tau", _WARMING, _warming(0.0)),
        EffectForm(
            "curved-yielded",
            "g (alpha z), c g^n with g as in curved; the yield displacement does not change",
            _WARMING,
            _warming(1.0),
        ),
    ),
)
