"""End stop: a stiff contact near the end of the stroke."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import DISPLACEMENT, FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape


@njit(STEP_SIGNATURE, cache=True)
def stop_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: stiffness, free travel [m], kind (0 linear, 1 square, 2 exponential), side (0 both, 1 out, -1 in)."""
    x = wire[DISPLACEMENT]
    side = parameters[3]
    if (side > 0.5 and x < 0.0) or (side < -0.5 and x > 0.0):
        return
    free = parameters[1]
    inside = abs(x) - free
    if parameters[2] == 2.0:
        force = math.exp(min(inside / (0.1 * free), 40.0)) * 0.1 * free
    else:
        if inside <= 0.0:
            return
        force = inside if parameters[2] == 0.0 else inside * inside
    wire[FORCE] += parameters[0] * force * (1.0 if x > 0.0 else -1.0)


def _step(value: float, free: float, kind: float, side: float = 0.0) -> Step:
    return Step("end-stop", Phase.FORCE_EFFECT, stop_step, np.array([value, free, kind, side]))


def _linear(values: Values) -> list[Step]:
    return [_step(values["stiffness"], values["free_travel"], 0.0)]


def _square(values: Values) -> list[Step]:
    return [_step(values["stiffness"], values["free_travel"], 1.0)]


def _exponential(values: Values) -> list[Step]:
    return [_step(values["stiffness"], values["free_travel"], 2.0)]


def _sides(values: Values) -> list[Step]:
    free = values["free_travel"]
    return [_step(values["stiffness_out"], free, 0.0, 1.0), _step(values["stiffness_in"], free, 0.0, -1.0)]


def _progressive_sides(values: Values) -> list[Step]:
    free = values["free_travel"]
    return [_step(values["stiffness_out"], free, 1.0, 1.0), _step(values["stiffness_in"], free, 1.0, -1.0)]


@njit(STEP_SIGNATURE, cache=True)
def contact_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: coefficient, free travel [m], exponent, part (1 spring out, -1 spring in, 0 damping of both)."""
    x = wire[DISPLACEMENT]
    side = 1.0 if x > 0.0 else -1.0
    inside = abs(x) - parameters[1]
    if inside <= 0.0 or parameters[3] * side < 0.0:
        return
    force = (inside / parameters[1]) ** parameters[2]
    if parameters[3] == 0.0:
        force *= wire[VELOCITY]
    else:
        force *= side
    wire[FORCE] += parameters[0] * force


def _contact(values: Values) -> list[Step]:
    free, power = values["free_travel"], values["exponent"]
    parts = (("stiffness_out", 1.0), ("stiffness_in", -1.0), ("damping", 0.0))
    return [
        Step("contact", Phase.FORCE_EFFECT, contact_step, np.array([values[name], free, power, part]))
        for name, part in parts
    ]


_FREE = shape("free_travel", "m", "travel before the contact", "stroke", 0.3, 0.995, (0.6, 0.8, 0.92))
_STIFFNESS = amplitude("stiffness", "N/m", "stiffness of the contact", "force/stroke", 0.0, 1e4)

EFFECT = Effect(
    name="end-stop",
    summary="the force rises steeply near the end of the stroke",
    physics="The piston touches a bump stop, a seal carrier or the end of the cylinder.",
    remedy="Shorten the stroke or centre the damper; declare free travel and stiffness.",
    residual="A steep rise beyond one or both ends of the stroke; nothing in the middle.",
    source="unilateral contact (linear and Hertz-like)",
    acts_on="force",
    forms=(
        EffectForm("linear", "k (|x| - x0) beyond x0", (_FREE, _STIFFNESS), _linear, {"stiffness": 0}),
        EffectForm(
            "progressive",
            "k (|x| - x0)^2 beyond x0",
            (_FREE, amplitude("stiffness", "N/m^2", "curvature of the contact", "force/stroke^2", 0.0, 1e5)),
            _square,
            {"stiffness": 0},
        ),
        EffectForm(
            "exponential", "k l exp((|x| - x0)/l), l = x0/10", (_FREE, _STIFFNESS), _exponential, {"stiffness": 0}
        ),
        EffectForm(
            "two-sided",
            "separate stiffness at each end",
            (
                _FREE,
                amplitude("stiffness_out", "N/m", "stiffness at positive displacement", "force/stroke", 0.0, 1e4),
                amplitude("stiffness_in", "N/m", "stiffness at negative displacement", "force/stroke", 0.0, 1e4),
            ),
            _sides,
            {"stiffness_out": 0, "stiffness_in": 1},
        ),
        EffectForm(
            "two-sided-progressive",
            "separate curvature at each end",
            (
                _FREE,
                amplitude("stiffness_out", "N/m^2", "curvature at positive displacement", "force/stroke^2", 0.0, 1e5),
                amplitude("stiffness_in", "N/m^2", "curvature at negative displacement", "force/stroke^2", 0.0, 1e5),
            ),
            _progressive_sides,
            {"stiffness_out": 0, "stiffness_in": 1},
        ),
    ),
    needs=("several-positions",),
    separated_by={"accumulator": Separation("the same motion at a smaller amplitude", ("amplitudes",))},
    refinements=(
        EffectForm(
            "contact",
            "(k + d v) ((|x| - x0)/x0)^n beyond x0, separate k at each end, after Hunt and Crossley 1975",
            (
                _FREE,
                shape("exponent", "1", "exponent of the indentation", "one", 0.7, 4.0, (1.5, 2.5)),
                amplitude(
                    "stiffness_out", "N", "spring at positive displacement, for an indentation of x0", "force", 0.0, 1e6
                ),
                amplitude("stiffness_in", "N", "at negative displacement", "force", 0.0, 1e6),
                amplitude("damping", "N s/m", "damping of the contact", "force/speed", 0.0, 1e6),
            ),
            _contact,
            {"stiffness_out": 0, "stiffness_in": 1, "damping": 2},
        ),
    ),
)
