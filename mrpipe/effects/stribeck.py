"""Stribeck effect: friction falls as speed rises."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    FORCE,
    HYSTERESIS,
    STEP_SIGNATURE,
    VELOCITY,
    Phase,
    Step,
    change_yield_force,
)
from mrpipe.effects.amplitudes import multiplied
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape, strength
from mrpipe.effects.profiles import FALLING, SPEED, free_profile


@njit(STEP_SIGNATURE, cache=True)
def stribeck_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, velocity scale [m/s], kind of fall (0..3), of amplitude (0, 1, 2), exponent."""
    ratio = abs(wire[VELOCITY]) / parameters[1]
    if parameters[2] == 0.0:
        fall = math.exp(-ratio)
    elif parameters[2] == 1.0:
        fall = math.exp(-ratio * ratio)
    elif parameters[2] == 3.0:
        fall = math.exp(-(ratio ** parameters[4]))
    else:
        fall = 1.0 / (1.0 + ratio * ratio)
    wire[FORCE] += parameters[0] * multiplied(wire, parameters[3]) * fall * wire[HYSTERESIS]


@njit(STEP_SIGNATURE, cache=True)
def yield_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: share, velocity scale [m/s], exponent. The yield force itself falls with the speed."""
    ratio = abs(wire[VELOCITY]) / parameters[1]
    change_yield_force(wire, 1.0 + parameters[0] * math.exp(-(ratio ** parameters[2])))


def _yield_force(values: Values) -> list[Step]:
    numbers = np.array([values["share"], values["velocity_scale"], values["exponent"]])
    return [Step("stribeck", Phase.COEFFICIENT_EFFECT, yield_force_step, numbers)]


def _step(value: float, scale: float, fall: float, of: float, power: float = 1.0) -> Step:
    return Step("stribeck", Phase.FORCE_EFFECT, stribeck_step, np.array([value, scale, fall, of, power]))


def _exponential(values: Values) -> list[Step]:
    return [_step(values["share"], values["velocity_scale"], 0.0, 0.0)]


def _gaussian(values: Values) -> list[Step]:
    return [_step(values["share"], values["velocity_scale"], 1.0, 0.0)]


def _rational(values: Values) -> list[Step]:
    return [_step(values["share"], values["velocity_scale"], 2.0, 0.0)]


def _own(values: Values) -> list[Step]:
    scale = values["velocity_scale"]
    return [_step(values["friction"], scale, 0.0, 1.0), _step(values["friction_rate"], scale, 0.0, 2.0)]


def _own_gaussian(values: Values) -> list[Step]:
    scale = values["velocity_scale"]
    return [_step(values["friction"], scale, 1.0, 1.0), _step(values["friction_rate"], scale, 1.0, 2.0)]


def _stretched(values: Values) -> list[Step]:
    return [_step(values["share"], values["velocity_scale"], 3.0, 0.0, values["exponent"])]


_SCALE = shape(
    "velocity_scale", "m/s", "speed over which the additional friction falls", "speed", 0.004, 0.7, (0.06, 0.2)
)
_SHARE = amplitude("share", "1", "additional yield force at zero speed", "one", 0.0, 5.0)
_POWER = shape("exponent", "1", "below 1: a cusp at zero speed", "one", 0.2, 4.0, (0.6, 1.5))
_OWN = (
    amplitude("friction", "N", "additional friction at zero speed without drive", "force", -0.05, 10.0),
    amplitude(
        "friction_rate", "N/drive", "change of the additional friction with the drive", "force/drive", -10.0, 10.0
    ),
)

EFFECT = Effect(
    name="stribeck",
    summary="the friction is larger at low speed than at high speed",
    physics="At low speed seals and guides are in contact; at high speed a film of fluid separates them.",
    remedy="Measure slow triangles at log-spaced speeds; replace seals or guides, or declare the additional friction.",
    residual="A peak near zero speed in both directions, which decays towards higher speed.",
    source="Stribeck 1902; Armstrong-Helouvry et al. 1994",
    acts_on="yield force",
    forms=(
        EffectForm("exponential", "alpha (1 + s exp(-|v|/vs))", (_SCALE, _SHARE), _exponential, {"share": 0}),
        EffectForm("gaussian", "alpha (1 + s exp(-(v/vs)^2))", (_SCALE, _SHARE), _gaussian, {"share": 0}),
        EffectForm("rational", "alpha (1 + s/(1 + (v/vs)^2))", (_SCALE, _SHARE), _rational, {"share": 0}),
        EffectForm(
            "own-friction", "alpha + (a + b u) exp(-|v|/vs)", (_SCALE, *_OWN), _own, {"friction": 0, "friction_rate": 1}
        ),
        EffectForm(
            "own-friction-gaussian",
            "alpha + (a + b u) exp(-(v/vs)^2)",
            (_SCALE, *_OWN),
            _own_gaussian,
            {"friction": 0, "friction_rate": 1},
        ),
    ),
    needs=("varying-speed",),
    separated_by={
        "quadratic-drag": Separation("triangular displacement at log-spaced speeds", ("speeds",)),
    },
    refinements=(
        EffectForm(
            "stretched",
            "alpha (1 + s exp(-(|v|/vs)^n))",
            (_SCALE, _POWER, _SHARE),
            _stretched,
            {"share": 0},
        ),
        EffectForm(
            "yield-force",
            "F_y (1 + s exp(-(|v|/vs)^n)) before the damper yields",
            (_SCALE, _POWER, strength("share", "1", "additional yield force at zero speed", "one", 0.0, 5.0, 0.05)),
            _yield_force,
        ),
        free_profile(
            "profile",
            "alpha (1 + sum s_k/(1 + (v/v_k)^4))",
            SPEED,
            FALLING,
            shape(
                "speed_scale", "m/s", "speed whose multiples are the positions of the steps", "speed", 0.1, 3.0, (0.5,)
            ),
            _SHARE,
        ),
    ),
)
