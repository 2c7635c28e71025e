"""Yield that rises with speed: the base form that real dampers ask for."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    CURRENT,
    FIRST,
    FORCE,
    HYSTERESIS,
    RATE_YIELD,
    STEP_SIGNATURE,
    VELOCITY,
    YIELD_FORCE,
    Phase,
    Step,
)
from mrpipe.dampers.viscoplastic import follow_dashpot
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Separation, Values, amplitude, shape, strength


@njit(STEP_SIGNATURE, cache=True)
def rounded_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, velocity scale [m/s], power of the drive (-1: of the yield force), kind of rounding."""
    ratio = wire[VELOCITY] / parameters[1]
    share = math.tanh(ratio) if parameters[3] == 0.0 else ratio / math.sqrt(1.0 + ratio * ratio)
    power = parameters[2]
    force = 1.0
    if power < 0.0:
        force = wire[YIELD_FORCE]
    elif power == 1.0:
        force = wire[CURRENT]
    elif power == 2.0:
        force = wire[CURRENT] ** 2
    wire[FORCE] += parameters[0] * force * share


@njit(STEP_SIGNATURE, cache=True)
def power_law_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: exponent or gain, speed scale [m/s], kind (0 power, 1 logarithm)."""
    speed = abs(wire[VELOCITY]) / parameters[1]
    if parameters[2] == 0.0:
        wire[RATE_YIELD] *= max(speed, 1e-9) ** parameters[0]
    else:
        wire[RATE_YIELD] *= 1.0 + parameters[0] * math.log1p(speed)


@njit(STEP_SIGNATURE, cache=True)
def dashpot_blend_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: share, spring rate [1/m], velocity scale [m/s]. State: atanh z, last velocity."""
    wire[HYSTERESIS] += parameters[0] * (
        follow_dashpot(wire, state, parameters[1], parameters[2], dt) - wire[HYSTERESIS]
    )


@njit(float64(float64, float64, float64[::1]), cache=True)
def _creep_rate(z: float, v: float, parameters: FloatArray) -> float:
    size = abs(z)
    ratio = parameters[3]
    bends = ratio * abs(v) * z * size + (1.0 - ratio) * v * size * size
    creeps = parameters[1] * size ** parameters[2] * (1.0 if z > 0.0 else -1.0)
    return parameters[0] * (v - bends - creeps)


@njit(STEP_SIGNATURE, cache=True)
def creeping_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: spring rate [1/m], creep speed [m/s], exponent, gamma over gamma plus beta. State: z, last velocity.

    Bouc-Wen's z (2.2) with n = 2, less what creeps under load; midpoints small enough for its stiffest part.
    """
    if wire[FIRST] > 0.5:
        state[0] = 0.0
        state[1] = wire[VELOCITY]
    first, change = state[1], wire[VELOCITY] - state[1]
    fastest = parameters[0] * (2.0 * max(abs(first), abs(wire[VELOCITY])) + parameters[1] * parameters[2])
    parts = min(int(fastest * dt / 0.5) + 1, 20)
    h, z = dt / parts, state[0]
    for k in range(parts):
        middle = z + 0.5 * h * _creep_rate(z, first + change * k / parts, parameters)
        z = min(max(z + h * _creep_rate(middle, first + change * (k + 0.5) / parts, parameters), -1.0), 1.0)
    state[0] = z
    state[1] = wire[VELOCITY]
    wire[HYSTERESIS] = z


def _creeping(values: Values) -> list[Step]:
    names = ("elastic_rate", "creep_speed", "creep_exponent", "shape_ratio")
    return [Step("creeping", Phase.HYSTERESIS, creeping_step, np.array([values[name] for name in names]), 2)]


def _rounded(value: float, scale: float, power: float, kind: float = 0.0) -> Step:
    return Step("rounded-yield", Phase.FORCE_EFFECT, rounded_step, np.array([value, scale, power, kind]))


def _tanh(values: Values) -> list[Step]:
    scale = values["velocity_scale"]
    return [
        _rounded(values["force"], scale, 0.0),
        _rounded(values["force_rate"], scale, 1.0),
        _rounded(values["force_square"], scale, 2.0),
    ]


def _algebraic(values: Values) -> list[Step]:
    scale = values["velocity_scale"]
    return [_rounded(values["force"], scale, 0.0, 1.0), _rounded(values["force_rate"], scale, 1.0, 1.0)]


def _power(values: Values) -> list[Step]:
    numbers = np.array([values["exponent"], values["reference_velocity"], 0.0])
    return [Step("power-yield", Phase.COEFFICIENT_EFFECT, power_law_step, numbers)]


def _logarithm(values: Values) -> list[Step]:
    numbers = np.array([values["gain"], values["velocity_scale"], 1.0])
    return [Step("logarithmic-yield", Phase.COEFFICIENT_EFFECT, power_law_step, numbers)]


def _dashpot(values: Values) -> list[Step]:
    numbers = np.array([values["share"], values["spring_rate"], values["velocity_scale"]])
    return [Step("saturating-dashpot", Phase.HYSTERESIS, dashpot_blend_step, numbers, 2)]


_SCALE = shape("velocity_scale", "m/s", "speed at which the yield force is reached", "speed", 0.01, 2.0, (0.08, 0.3))
_OWN = (
    amplitude("force", "N", "part of the yield force that needs speed, no drive", "force", -0.1, 10.0),
    amplitude("force_rate", "N/drive", "its rise with the drive", "force/drive", -10.0, 20.0),
)

EFFECT = Effect(
    name="rate-dependent-yield",
    summary="the yield force rises with speed, steeply first, then ever less",
    physics="The yielded plug shears in a layer that thickens with speed; the force rounds where a model has a corner.",
    remedy="Take a base form with rounded yield; measure slow triangles at log-spaced speeds.",
    residual="Over velocity a step with rounded shoulders: steep at low speed, flat at high speed, scaled with the "
    "drive.",
    source="Herschel and Bulkley 1926; alpha(u) tanh(v/v0) and a power of |v| fit recordings of real dampers",
    acts_on="yield force",
    forms=(
        EffectForm(
            "rounded",
            "F + (a + b u + c u^2) tanh(v/v0)",
            (_SCALE, *_OWN, amplitude("force_square", "N/drive^2", "its curvature", "force/drive^2", -20.0, 20.0)),
            _tanh,
            {"force": 0, "force_rate": 1, "force_square": 2},
        ),
        EffectForm(
            "algebraic",
            "F + (a + b u) v/sqrt(v^2 + v0^2)",
            (_SCALE, *_OWN),
            _algebraic,
            {"force": 0, "force_rate": 1},
        ),
        EffectForm(
            "power",
            "alpha (|v|/v_ref)^p",
            (
                strength("exponent", "1", "power of the speed", "one", 0.0, 1.2, 0.02),
                shape("reference_velocity", "m/s", "speed of factor 1", "speed", 0.999, 1.001, (1.0,)),
            ),
            _power,
            dissipative=True,
        ),
        EffectForm(
            "logarithm",
            "alpha (1 + g log(1 + |v|/v0))",
            (
                strength("gain", "1", "rise for each e-fold of speed", "one", 0.0, 2.0, 0.02),
                shape("velocity_scale", "m/s", "speed where the rise begins", "speed", 0.001, 0.5, (0.02, 0.1)),
            ),
            _logarithm,
            dissipative=True,
        ),
        EffectForm(
            "saturating-dashpot",
            "z' = q (v - v0 atanh z)",
            (
                strength("share", "1", "share of the yield force that is so", "one", 0.0, 1.0, 0.05),
                shape(
                    "spring_rate",
                    "1/m",
                    "stiffness of the spring over the yield force",
                    "one/stroke",
                    2.0,
                    200.0,
                    (10.0, 40.0),
                ),
                shape("velocity_scale", "m/s", "speed of the dashpot", "speed", 0.005, 1.0, (0.05, 0.2)),
            ),
            _dashpot,
        ),
    ),
    needs=("varying-speed",),
    separated_by={
        "stribeck": Separation("triangular displacement at log-spaced speeds", ("speeds",)),
        "quadratic-drag": Separation("triangular displacement at log-spaced speeds", ("speeds",)),
    },
    refinements=(
        EffectForm(
            "creeping",
            "z' = q (v - r |v| z |z| - (1 - r) v z^2 - v0 |z|^m sign z), after Norton's law of creep",
            (
                shape("elastic_rate", "1/m", "stiffness over the yield force", "one/stroke", 2.0, 500.0, (10.0, 40.0)),
                shape("creep_speed", "m/s", "creep under the full force", "speed", 0.002, 2.0, (0.03, 0.2)),
                shape("creep_exponent", "1", "power of the force that drives it", "one", 1.0, 20.0, (3.0,)),
                Parameter("shape_ratio", "1", "gamma over gamma plus beta", "one", 0.0, 1.0, (0.5,)),
            ),
            _creeping,
            dissipative=True,
        ),
    ),
)
