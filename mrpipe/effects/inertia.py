"""Inertia of rod and fluid beyond the load cell."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import ACCELERATION, CURRENT, DISPLACEMENT, FIRST, FORCE, STEP_SIGNATURE, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape


@njit(STEP_SIGNATURE, cache=True)
def mass_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: mass [kg], power of the drive, filter rate [1/s] (0 for none). State: filtered acceleration."""
    a = wire[ACCELERATION]
    if parameters[2] > 0.0:
        if wire[FIRST] > 0.5:
            state[0] = a
        share = 1.0 - np.exp(-parameters[2] * dt)
        state[0] += share * (a - state[0])
        a = state[0]
    wire[FORCE] += parameters[0] * a * (wire[CURRENT] if parameters[1] > 0.5 else 1.0)


@njit(STEP_SIGNATURE, cache=True)
def mass_by_place_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, power of the displacement."""
    wire[FORCE] += parameters[0] * wire[DISPLACEMENT] ** parameters[1] * wire[ACCELERATION]


def _by_place(values: Values) -> list[Step]:
    return [
        Step(name, Phase.FORCE_EFFECT, mass_by_place_step, np.array([values[name], power]))
        for name, power in (("mass", 0.0), ("mass_slope", 1.0), ("mass_curvature", 2.0))
    ]


def _mass(values: Values) -> list[Step]:
    return [Step("mass", Phase.FORCE_EFFECT, mass_step, np.array([values["mass"], 0.0, 0.0]), 1)]


def _with_drive(values: Values) -> list[Step]:
    return [
        Step("mass", Phase.FORCE_EFFECT, mass_step, np.array([values["mass"], 0.0, 0.0]), 1),
        Step("mass-with-drive", Phase.FORCE_EFFECT, mass_step, np.array([values["mass_rate"], 1.0, 0.0]), 1),
    ]


def _late(values: Values) -> list[Step]:
    return [Step("mass", Phase.FORCE_EFFECT, mass_step, np.array([values["mass"], 0.0, 1.0 / values["lag"]]), 1)]


_MASS = amplitude("mass", "kg", "moving mass", "force/acceleration", 0.0, 10.0)

EFFECT = Effect(
    name="inertia",
    summary="a force proportional to acceleration",
    physics="The load cell also measures the force that accelerates rod, clevis and fluid between load cell and "
    "piston.",
    remedy="Weigh the moving parts beyond the load cell and subtract mass times acceleration, or move the load cell.",
    residual="A straight line over acceleration. Over displacement it looks like a spring with negative stiffness "
    "proportional to the square of the frequency.",
    source="Newton; fluid inertance as in Wang and Wereley",
    acts_on="force",
    forms=(
        EffectForm("mass", "F + m a", (_MASS,), _mass, {"mass": 0}),
        EffectForm(
            "mass-with-drive",
            "F + (m + m1 u) a",
            (
                _MASS,
                # a mass that falls with the drive would be negative at a large one
                amplitude("mass_rate", "kg/drive", "rise of the mass with the drive", "force/acceleration/drive", 0.0),
            ),
            _with_drive,
            {"mass": 0, "mass_rate": 1},
        ),
    ),
    needs=("several-frequencies",),
    separated_by={
        "accumulator": Separation("the same stroke at several frequencies", ("frequencies",)),
        "channel-skew": Separation("time-stamp check, frequency sweep", ("frequencies",)),
    },
    refinements=(
        EffectForm(
            "late-mass",
            "F + m w, w' = (a - w)/tau",
            (shape("lag", "s", "lag of the mass behind the rod", "one", 2e-4, 0.02, (0.002,)), _MASS),
            _late,
            {"mass": 0},
        ),
        EffectForm(
            "mass-by-place",
            "F + (m + m1 x + m2 x^2) a",
            (
                _MASS,
                amplitude(
                    "mass_slope", "kg/m", "change of the mass along the stroke", "force/acceleration/stroke", -5.0, 5.0
                ),
                amplitude(
                    "mass_curvature",
                    "kg/m^2",
                    "rise of the mass towards both ends",
                    "force/acceleration/stroke^2",
                    -5.0,
                    5.0,
                ),
            ),
            _by_place,
            {"mass": 0, "mass_slope": 1, "mass_curvature": 2},
        ),
    ),
)
