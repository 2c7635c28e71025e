"""Asymmetry: the force differs between the two directions of motion."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    CURRENT,
    EXTRA_FORCE,
    FORCE,
    HYSTERESIS,
    HYSTERETIC_FORCE,
    STEP_SIGNATURE,
    VELOCITY,
    VISCOUS_FORCE,
    Phase,
    Step,
    change_yield_force,
)
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape, strength

SQUARE_ROOT = 2.0
"""Sharpness of the transition between the directions with which it is v/sqrt(v^2 + v_t^2)."""


@njit(STEP_SIGNATURE, cache=True)
def asymmetry_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, kind (0 yield, 1 viscous, 2 both, 3 constant, 4 with drive)."""
    kind = parameters[1]
    if kind == 0.0:
        force = abs(wire[HYSTERETIC_FORCE])
    elif kind == 1.0:
        force = abs(wire[VISCOUS_FORCE])
    elif kind == 2.0:
        force = abs(wire[HYSTERETIC_FORCE] + wire[VISCOUS_FORCE] + wire[EXTRA_FORCE])
    elif kind == 3.0:
        force = abs(wire[HYSTERESIS])
    elif kind == 4.0:
        force = abs(wire[HYSTERESIS]) * wire[CURRENT]
    else:
        force = abs(wire[VELOCITY])
    wire[FORCE] += parameters[0] * force


@njit(STEP_SIGNATURE, cache=True)
def rounded_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, force [N] below which the difference between the directions fades."""
    force = wire[HYSTERETIC_FORCE] + wire[VISCOUS_FORCE] + wire[EXTRA_FORCE]
    wire[FORCE] += parameters[0] * (math.sqrt(force * force + parameters[1] * parameters[1]) - parameters[1])


@njit(float64(float64, float64, float64), cache=True)
def direction_of(velocity: float, transition_velocity: float, sharpness: float) -> float:
    """Return the direction of motion, -1 to 1: v/(|v|^m + v_t^m)^(1/m), with velocities in m/s and the sharpness m."""
    ratio = abs(velocity) / transition_velocity
    if sharpness == SQUARE_ROOT:
        size = ratio / math.sqrt(1.0 + ratio * ratio)
    elif ratio > 1.0:
        size = (1.0 + ratio**-sharpness) ** (-1.0 / sharpness)
    else:
        size = ratio * (1.0 + ratio**sharpness) ** (-1.0 / sharpness)
    return math.copysign(size, velocity)


@njit(STEP_SIGNATURE, cache=True)
def direction_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, transition velocity [m/s], kind (0 yield, 1 both), sharpness of the transition.

    The direction of the flow decides, not that of the force: after a reversal the two differ until the damper yields.
    """
    direction = direction_of(wire[VELOCITY], parameters[1], parameters[3])
    force = wire[HYSTERETIC_FORCE] if parameters[2] == 0.0 else wire[HYSTERETIC_FORCE] + wire[VISCOUS_FORCE]
    wire[FORCE] += parameters[0] * force * direction


@njit(STEP_SIGNATURE, cache=True)
def yield_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: share, transition velocity [m/s], sharpness. The yield force differs between the directions."""
    change_yield_force(wire, 1.0 + parameters[0] * direction_of(wire[VELOCITY], parameters[1], parameters[2]))


def _yield_force(values: Values) -> list[Step]:
    numbers = np.array([values["share"], values["transition_velocity"], values.get("sharpness", SQUARE_ROOT)])
    return [Step("asymmetry", Phase.COEFFICIENT_EFFECT, yield_force_step, numbers)]


def _direction(kind: float) -> Callable[[Values], list[Step]]:
    def steps(values: Values) -> list[Step]:
        sharpness = values.get("sharpness", SQUARE_ROOT)
        numbers = np.array([values["share"], values["transition_velocity"], kind, sharpness])
        return [Step("asymmetry", Phase.FORCE_EFFECT, direction_step, numbers)]

    return steps


def _one(value: float, kind: float) -> Step:
    return Step("asymmetry", Phase.FORCE_EFFECT, asymmetry_step, np.array([value, kind]))


def _yield(values: Values) -> list[Step]:
    return [_one(values["share"], 0.0)]


def _viscous(values: Values) -> list[Step]:
    return [_one(values["share"], 1.0)]


def _both(values: Values) -> list[Step]:
    return [_one(values["share"], 2.0)]


def _own(values: Values) -> list[Step]:
    return [_one(values["friction"], 3.0), _one(values["friction_rate"], 4.0), _one(values["drag"], 5.0)]


def _rounded(values: Values) -> list[Step]:
    numbers = np.array([values["share"], values["knee_force"]])
    return [Step("asymmetry", Phase.FORCE_EFFECT, rounded_step, numbers)]


_SHARE = amplitude("share", "1", "half the difference of the two directions over their mean", "one", -0.9, 0.9)
_TRANSITION = shape(
    "transition_velocity", "m/s", "speed over which the direction changes", "speed", 1e-4, 0.5, (0.004, 0.06)
)
_SHARPNESS = shape("sharpness", "1", "m: 2 is the square root, about 3 a hyperbolic tangent", "one", 0.7, 12.0, (2.5,))

EFFECT = Effect(
    name="asymmetry",
    summary="forces differ between the two directions of motion",
    physics="The piston areas of the two chambers differ, a seal has more friction in one direction, or the rod "
    "leaves the cylinder on one side only.",
    remedy="Test the damper in both orientations. If the asymmetry turns with the damper, the damper causes it, "
    "otherwise the machine.",
    residual="A step between the two directions of motion, seen over velocity, or a slope in one direction only.",
    source="general knowledge: the chambers of a single-rod damper differ",
    acts_on="force",
    forms=(
        EffectForm("yield", "F + s |alpha z|", (_SHARE,), _yield, {"share": 0}),
        EffectForm("viscous", "F + s |c v|", (_SHARE,), _viscous, {"share": 0}),
        EffectForm(
            "both", "F + s |alpha z + c v + k0 w|, with the spring k0 inside, if any", (_SHARE,), _both, {"share": 0}
        ),
        EffectForm(
            "yield-by-direction",
            "F + s alpha z v/sqrt(v^2 + v_t^2)",
            (_SHARE, _TRANSITION),
            _direction(0.0),
            {"share": 0},
        ),
        EffectForm(
            "both-by-direction",
            "F + s (alpha z + c v) v/sqrt(v^2 + v_t^2)",
            (_SHARE, _TRANSITION),
            _direction(1.0),
            {"share": 0},
        ),
        EffectForm(
            "own-coefficients",
            "F + |z| (a + b u) + c |v|",
            (
                amplitude("friction", "N", "difference without drive", "force", -2.0, 2.0),
                amplitude(
                    "friction_rate", "N/drive", "change of the difference with the drive", "force/drive", -2.0, 2.0
                ),
                amplitude("drag", "N*s/m", "difference of the viscosities", "force/speed", -2.0, 2.0),
            ),
            _own,
            {"friction": 0, "friction_rate": 1, "drag": 2},
        ),
    ),
    separated_by={
        "offset": Separation("constant drive at several speeds; rest at several drives", ("constants", "rest"))
    },
    refinements=(
        EffectForm(
            "rounded",
            "F + s (sqrt((alpha z + c v)^2 + f^2) - f)",
            (
                _SHARE,
                shape(
                    "knee_force",
                    "N",
                    "force below which the difference vanishes gradually",
                    "force",
                    1e-3,
                    2.0,
                    (0.03, 0.2),
                ),
            ),
            _rounded,
            {"share": 0},
        ),
        EffectForm(
            "yield-by-sharp-direction",
            "F + s alpha z v/(|v|^m + v_t^m)^(1/m)",
            (_SHARE, _TRANSITION, _SHARPNESS),
            _direction(0.0),
            {"share": 0},
        ),
        EffectForm(
            "yield-force",
            "F_y (1 + s v/(|v|^m + v_t^m)^(1/m)) before the damper yields",
            (
                strength(
                    "share", "1", "half the difference of the two directions over their mean", "one", -0.9, 0.9, 0.05
                ),
                _TRANSITION,
                _SHARPNESS,
            ),
            _yield_force,
        ),
    ),
)
