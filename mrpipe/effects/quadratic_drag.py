"""Quadratic drag: orifice losses of the turbulent flow."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape
from mrpipe.effects.profiles import CONVEX, SPEED, free_profile


@njit(STEP_SIGNATURE, cache=True)
def drag_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: coefficient, exponent, reference speed [m/s], power of the drive (0 or 1)."""
    v = wire[VELOCITY]
    speed = abs(v) / parameters[2]
    force = speed ** parameters[1] * (1.0 if v >= 0.0 else -1.0)
    wire[FORCE] += parameters[0] * force * (wire[CURRENT] if parameters[3] > 0.5 else 1.0)


@njit(STEP_SIGNATURE, cache=True)
def transition_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: coefficient, speed [m/s] at which the flow becomes turbulent."""
    speed = abs(wire[VELOCITY])
    share = speed / (speed + parameters[1])
    wire[FORCE] += parameters[0] * share * speed * wire[VELOCITY]


def _step(value: float, exponent: float, with_drive: float = 0.0) -> Step:
    return Step("drag", Phase.FORCE_EFFECT, drag_step, np.array([value, exponent, 1.0, with_drive]))


def _square(values: Values) -> list[Step]:
    return [_step(values["drag"], 2.0)]


def _with_drive(values: Values) -> list[Step]:
    return [_step(values["drag"], 2.0), _step(values["drag_rate"], 2.0, 1.0)]


def _power(values: Values) -> list[Step]:
    return [_step(values["drag"], values["exponent"])]


def _transition(values: Values) -> list[Step]:
    numbers = np.array([values["drag"], values["transition_speed"]])
    return [Step("drag", Phase.FORCE_EFFECT, transition_step, numbers)]


_DRAG = amplitude("drag", "N*s^2/m^2", "force at 1 m/s", "force/speed^2", 0.0, 20.0)

EFFECT = Effect(
    name="quadratic-drag",
    summary="a force proportional to the square of the speed",
    physics="The fluid is throttled in valve and gap, and its kinetic energy is lost behind them.",
    remedy="Test up to the largest speed; widen the bypass, or declare the coefficient of the drag.",
    residual="Proportional to the square of the speed, with the sign of the velocity: small at medium speed, large at "
    "the highest speed.",
    source="Bernoulli and Borda; orifice flow",
    acts_on="viscous force",
    forms=(
        EffectForm("square", "F + c v|v|", (_DRAG,), _square, {"drag": 0}, dissipative=True),
        EffectForm(
            "square-with-drive",
            "F + (c + d u) v|v|",
            (
                _DRAG,
                amplitude(
                    "drag_rate", "N*s^2/m^2/drive", "change of the drag with the drive", "force/speed^2/drive", -5.0
                ),
            ),
            _with_drive,
            {"drag": 0, "drag_rate": 1},
        ),
        EffectForm(
            "power",
            "F + c |v|^p sign v",
            (
                shape("exponent", "1", "power of the speed", "one", 1.4, 3.2, (1.75, 2.5)),
                amplitude("drag", "N*(s/m)^p", "force at 1 m/s", "force/speed^2", 0.0, 200.0),
            ),
            _power,
            {"drag": 0},
            dissipative=True,
        ),
    ),
    needs=("varying-speed",),
    separated_by={
        "stribeck": Separation("triangular displacement at log-spaced speeds", ("speeds",)),
    },
    refinements=(
        EffectForm(
            "transition",
            "F + c v|v| |v|/(|v| + v_t)",
            (shape("transition_speed", "m/s", "laminar below it", "speed", 0.01, 1.0, (0.1, 0.4)), _DRAG),
            _transition,
            {"drag": 0},
            dissipative=True,
        ),
        free_profile(
            "profile",
            "F + sum d_k h_k(|v|) sign v, h_k convex",
            SPEED,
            CONVEX,
            shape(
                "speed_scale",
                "m/s",
                "speed whose multiples are the positions of the profile",
                "speed",
                0.3,
                1.5,
                (1.0,),
            ),
            amplitude("drag", "N*s/m", "increase of the slope", "force/speed", 0.0, 20.0),
        ),
    ),
)
