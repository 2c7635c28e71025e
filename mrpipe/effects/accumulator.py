"""Gas accumulator: a spring in parallel with the damper."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import DISPLACEMENT, FORCE, STEP_SIGNATURE, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape


@njit(STEP_SIGNATURE, cache=True)
def spring_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: stiffness [N/m], kind (1 linear, 2 cube, 3 square, 4 gas), gas length [m]."""
    x = wire[DISPLACEMENT]
    kind = parameters[1]
    if kind == 1.0:
        force = x
    elif kind == 2.0:
        force = x * x * x
    elif kind == 3.0:
        force = x * x
    else:
        length = parameters[2]
        ratio = max(1.0 - x / length, 0.05)
        force = (ratio**-1.4 - 1.0) * length / 1.4
    wire[FORCE] += parameters[0] * force


def _spring(name: str, value: float, kind: float, length: float = 0.0) -> Step:
    return Step(name, Phase.FORCE_EFFECT, spring_step, np.array([value, kind, length]))


def _linear(values: Values) -> list[Step]:
    return [_spring("spring", values["stiffness"], 1.0)]


def _curved(values: Values) -> list[Step]:
    return [_spring("spring", values["stiffness"], 1.0), _spring("curvature", values["curvature"], 3.0)]


def _hardening(values: Values) -> list[Step]:
    return [*_curved(values), _spring("hardening", values["hardening"], 2.0)]


def _gas(values: Values) -> list[Step]:
    return [_spring("gas", values["stiffness"], 4.0, values["gas_length"])]


_CURVATURE = amplitude("curvature", "N/m^2", "second-order stiffness", "force/stroke^2", -5.0, 5.0)
_STIFFNESS = amplitude("stiffness", "N/m", "stiffness around the middle of the stroke", "force/stroke", 0.0, 5.0)

EFFECT = Effect(
    name="accumulator",
    summary="a force proportional to displacement, with a preload",
    physics="The rod displaces oil against a gas cushion, which acts as a spring in parallel with the damper.",
    remedy="Measure the force at rest at several positions; check the accumulator's charge, or declare its stiffness.",
    residual="A straight line over displacement, the same at every drive and speed, plus a constant (preload).",
    source="Spencer et al. 1997 (k1, x0 of the modified Bouc-Wen model); polytropic gas spring",
    acts_on="force",
    forms=(
        EffectForm("linear", "F + k x", (_STIFFNESS,), _linear, {"stiffness": 0}),
        EffectForm(
            "curved",
            "F + k x + k2 x^2",
            (_STIFFNESS, _CURVATURE),
            _curved,
            {"stiffness": 0, "curvature": 1},
        ),
        EffectForm(
            "gas",
            "F + k L ((1 - x/L)^-1.4 - 1)/1.4",
            (shape("gas_length", "m", "length of the gas cushion", "stroke", 1.5, 50.0, (4.0,)), _STIFFNESS),
            _gas,
            {"stiffness": 0},
        ),
        EffectForm(
            "hardening",
            "F + k x + k2 x^2 + k3 x^3",
            (
                _STIFFNESS,
                _CURVATURE,
                amplitude("hardening", "N/m^3", "third-order stiffness", "force/stroke^3", -5.0, 5.0),
            ),
            _hardening,
            {"stiffness": 0, "curvature": 1, "hardening": 2},
        ),
    ),
    separated_by={
        "migration": Separation("rest at several positions of the stroke", ("positions",)),
        "inertia": Separation("the same stroke at several frequencies", ("frequencies",)),
        "end-stop": Separation("the same motion at a smaller amplitude", ("amplitudes",)),
    },
)
