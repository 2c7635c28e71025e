"""Pinching: the yield force is lower around the middle of the stroke."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    DISPLACEMENT,
    FORCE,
    HYSTERESIS,
    STEP_SIGNATURE,
    Phase,
    Step,
    change_yield_force,
)
from mrpipe.effects.amplitudes import multiplied
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Separation, Values, amplitude, shape, strength


@njit(STEP_SIGNATURE, cache=True)
def pinching_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, width [m], kind of dip (0 gaussian, 1 rational, 2 exponential), of amplitude (0, 1, 2),
    middle [m], exponent (of kind 3).
    """
    ratio = (wire[DISPLACEMENT] - parameters[4]) / parameters[1]
    if parameters[2] == 0.0:
        dip = math.exp(-ratio * ratio)
    elif parameters[2] == 3.0:
        dip = 1.0 / (1.0 + abs(ratio) ** parameters[5])
    elif parameters[2] == 1.0:
        dip = 1.0 / (1.0 + ratio * ratio)
    else:
        dip = math.exp(-abs(ratio))
    wire[FORCE] -= parameters[0] * multiplied(wire, parameters[3]) * dip * wire[HYSTERESIS]


@njit(STEP_SIGNATURE, cache=True)
def yield_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: depth, half width [m], middle [m], exponent. The yield force itself has the dip."""
    ratio = abs(wire[DISPLACEMENT] - parameters[2]) / parameters[1]
    change_yield_force(wire, 1.0 - parameters[0] / (1.0 + ratio ** parameters[3]))


@njit(STEP_SIGNATURE, cache=True)
def yield_profile_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: distance of the places [m], middle [m], share missing at each place from left to right.

    Between the places the share is a quadratic spline (basis splines with uniform knots).
    """
    count = parameters.shape[0] - 2
    position = (wire[DISPLACEMENT] - parameters[1]) / parameters[0] + 0.5 * (count - 1)
    missing = 0.0
    for place in range(count):
        distance = abs(position - place)
        if distance < 0.5:
            missing += parameters[2 + place] * (0.75 - distance * distance)
        elif distance < 1.5:
            missing += parameters[2 + place] * 0.5 * (1.5 - distance) * (1.5 - distance)
    change_yield_force(wire, 1.0 - missing)


def _yield_profile(values: Values) -> list[Step]:
    numbers = np.array([values["distance"], values["middle"], *(values[name] for name in _PLACES)])
    return [Step("pinching", Phase.COEFFICIENT_EFFECT, yield_profile_step, numbers)]


def _yield_force(values: Values) -> list[Step]:
    numbers = np.array([values["depth"], values["width"], values["middle"], values["exponent"]])
    return [Step("pinching", Phase.COEFFICIENT_EFFECT, yield_force_step, numbers)]


def _step(value: float, width: float, dip: float, of: float = 0.0, middle: float = 0.0, power: float = 2.0) -> Step:
    numbers = np.array([value, width, dip, of, middle, power])
    return Step("pinching", Phase.FORCE_EFFECT, pinching_step, numbers)


def _gaussian(values: Values) -> list[Step]:
    return [_step(values["depth"], values["width"], 0.0)]


def _rational(values: Values) -> list[Step]:
    return [_step(values["depth"], values["width"], 1.0)]


def _exponential(values: Values) -> list[Step]:
    return [_step(values["depth"], values["width"], 2.0)]


def _own(values: Values) -> list[Step]:
    width = values["width"]
    return [_step(values["friction"], width, 0.0, 1.0), _step(values["friction_rate"], width, 0.0, 2.0)]


def _aside(kind: float) -> Callable[[Values], list[Step]]:
    def steps(values: Values) -> list[Step]:
        power = values.get("exponent", 2.0)
        return [_step(values["depth"], values["width"], kind, middle=values["middle"], power=power)]

    return steps


_PLACES = tuple(f"depth_{number}" for number in range(1, 8))
_WIDTH = shape("width", "m", "half width of the dip", "stroke", 0.02, 1.0, (0.12, 0.4))
_MIDDLE = Parameter("middle", "m", "position of the lowest yield force", "stroke", -0.8, 0.8, (-0.3, 0.3))
_NEAR_MIDDLE = replace(_MIDDLE, starts=(0.0,))
_FLATNESS = shape("exponent", "1", "flatness", "one", 1.0, 12.0, (3.0,))
_DEPTH = amplitude("depth", "1", "missing share of the yield force in the middle", "one", 0.0, 1.0)

EFFECT = Effect(
    name="pinching",
    summary="loops are narrow around the middle of the stroke",
    physics="Wear widens the gap where the piston passes most often, or parts slip before they engage.",
    remedy="Test about another mean position; renew the bore or the pads.",
    residual="Opposite to the force around the middle of the stroke, and zero towards its ends: loops with a waist.",
    source="Baber and Noori 1985",
    acts_on="yield force",
    forms=(
        EffectForm("gaussian", "alpha (1 - d exp(-(x/w)^2))", (_WIDTH, _DEPTH), _gaussian, {"depth": 0}),
        EffectForm("rational", "alpha (1 - d/(1 + (x/w)^2))", (_WIDTH, _DEPTH), _rational, {"depth": 0}),
        EffectForm("exponential", "alpha (1 - d exp(-|x|/w))", (_WIDTH, _DEPTH), _exponential, {"depth": 0}),
        EffectForm(
            "off-centre", "alpha (1 - d exp(-((x - m)/w)^2))", (_WIDTH, _MIDDLE, _DEPTH), _aside(0.0), {"depth": 0}
        ),
        EffectForm(
            "own-friction",
            "alpha - (a + b u) exp(-(x/w)^2)",
            (
                _WIDTH,
                amplitude("friction", "N", "missing force without drive", "force", -0.05, 5.0),
                amplitude(
                    "friction_rate", "N/drive", "change of the missing force with the drive", "force/drive", -0.1, 5.0
                ),
            ),
            _own,
            {"friction": 0, "friction_rate": 1},
        ),
    ),
    separated_by={"migration": Separation("the same motion about another mean position", ("middle",))},
    refinements=(
        EffectForm("cusp", "alpha (1 - d exp(-|x - m|/w))", (_WIDTH, _NEAR_MIDDLE, _DEPTH), _aside(2.0), {"depth": 0}),
        EffectForm(
            "flat",
            "alpha (1 - d/(1 + (|x - m|/w)^n))",
            (_WIDTH, _NEAR_MIDDLE, _FLATNESS, _DEPTH),
            _aside(3.0),
            {"depth": 0},
        ),
        EffectForm(
            "yield-force",
            "F_y (1 - d/(1 + (|x - m|/w)^n)) before the damper yields",
            (
                _WIDTH,
                _NEAR_MIDDLE,
                _FLATNESS,
                strength("depth", "1", "missing share of the yield force in the middle", "one", 0.0, 1.0, 0.05),
            ),
            _yield_force,
        ),
        EffectForm(
            "yield-force-profile",
            "F_y (1 - d(x)) before the damper yields, d a free profile",
            (
                shape(
                    "distance", "m", "distance between the positions of the profile", "stroke", 0.05, 0.5, (0.15, 0.3)
                ),
                _NEAR_MIDDLE,
                *(
                    strength(
                        name,
                        "1",
                        f"missing share of the yield force at position {name[6:]}",
                        "one",
                        0.0,
                        0.95,
                        0.05,
                    )
                    for name in _PLACES
                ),
            ),
            _yield_profile,
        ),
    ),
)
