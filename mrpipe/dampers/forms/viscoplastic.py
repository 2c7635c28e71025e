"""Viscoplastic overstress in series with a spring."""

from __future__ import annotations

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import FIRST, HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_LOSS, Phase, Step
from mrpipe.dampers.rosenbrock import damping_factor, parts_of_step

LEAST = 1e-6
"""Numerical technique: least yield force after effects, as a share of that without them."""


@njit(float64(float64, float64, float64, float64[::1]), cache=True)
def overstress_rate(z: float, v: float, limit: float, parameters: FloatArray) -> float:
    """Return z' [1/s] while the damper flows beyond `limit`; parameters as in :func:`viscoplastic_step`."""
    over = abs(z) / limit - 1.0
    if over <= 0.0:
        return parameters[0] * v
    return parameters[0] * (v - parameters[1] * over ** parameters[2] * (1.0 if z > 0.0 else -1.0))


@njit(STEP_SIGNATURE, cache=True)
def viscoplastic_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: spring rate [1/m], speed of flow at twice the yield force [m/s], exponent. State: z, last velocity,
    last limit.

    z is the force over the yield force at this drive, without effects. A reduction of the yield force by effects lowers
    the limit of z beyond which the damper flows, so that the spring keeps its force while the yield force changes.
    Integrated by the Rosenbrock method of second order of :mod:`mrpipe.dampers.rosenbrock`.
    """
    limit = max(1.0 - wire[YIELD_LOSS], LEAST)
    if wire[FIRST] > 0.5:
        state[0] = 0.0
        state[1] = wire[VELOCITY]
        state[2] = limit
        wire[HYSTERESIS] = 0.0
        return
    rate, flow, power = parameters[0], parameters[1], parameters[2]
    first, change = state[1], wire[VELOCITY] - state[1]
    speed = max(abs(first), abs(wire[VELOCITY]))
    steady = (speed / flow) ** (1.0 / power)
    # flow steady^(power - 1) is the speed over the steady overstress
    fastest = speed + power * speed / steady if steady > 0.0 else 0.0
    parts = parts_of_step(rate * fastest, dt)
    h, z = dt / parts, state[0]
    # the overstress of steady flow at the largest speed is never exceeded; the method itself oversteps it, and can
    # become unstable, if a long step begins before yielding
    most = max(abs(z), max(limit, state[2]) * (1.0 + steady))
    for k in range(parts):
        v0, v1 = first + change * k / parts, first + change * (k + 1) / parts
        before = state[2] + (limit - state[2]) * k / parts
        after = state[2] + (limit - state[2]) * (k + 1) / parts
        over = abs(z) / before - 1.0
        bent = flow * over ** (power - 1.0) if over > 0.0 else 0.0
        factor = damping_factor(h, -rate * power * bent / before)
        k1 = factor * rate * (v0 - bent * over * (1.0 if z > 0.0 else -1.0))
        k2 = factor * (overstress_rate(z + h * k1, v1, after, parameters) - 2.0 * k1)
        z = min(max(z + h * (1.5 * k1 + 0.5 * k2), -most), most)
    state[0] = z
    state[1] = wire[VELOCITY]
    state[2] = limit
    wire[HYSTERESIS] = z / limit


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["elastic_rate"], values["flow_speed"], values["exponent"]], dtype=np.float64)
    return [Step("viscoplastic", Phase.HYSTERESIS, viscoplastic_step, numbers, 3)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum(1.0 + (at.speed / values["flow_speed"]) ** (1.0 / values["exponent"]), at)


FORM = BaseForm(
    name="viscoplastic",
    summary="z' = q (v - v_f <|z| - 1>^n sign z): a spring in series with flow at a rate that depends on the force "
    "beyond yield",
    source="Perzyna 1966, Fundamental problems in viscoplasticity, Adv. Appl. Mech. 9, 243-377",
    parameters=(
        shape("elastic_rate", "1/m", "stiffness over the yield force", "one/stroke", 2.0, 500.0, (20.0, 60.0)),
        shape("flow_speed", "m/s", "speed of flow at twice the yield force", "speed", 0.02, 50.0, (3.0, 0.5)),
        shape("exponent", "1", "exponent of the force beyond yield", "one", 1.0, 6.0, (1.5,)),
    ),
    steps=_steps,
    post_yield=_post_yield,
    family="rate-dependent-yield",
)
