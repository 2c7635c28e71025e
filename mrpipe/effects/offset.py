"""Offset of the load cell that depends on drive or time; offsets that change between tests are fitted separately."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, DRIVE, FORCE, STEP_SIGNATURE, TIME, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape


@njit(STEP_SIGNATURE, cache=True)
def offset_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, kind (0 drive, 1 drive squared, 2 effective drive, 3 time, 4 drive to a power), power.

    Kind 5 is a zero that warms up: the third parameter is then its time constant [s].
    """
    kind = parameters[1]
    if kind == 0.0:
        wire[FORCE] += parameters[0] * wire[DRIVE]
    elif kind == 1.0:
        wire[FORCE] += parameters[0] * wire[DRIVE] * wire[DRIVE]
    elif kind == 2.0:
        wire[FORCE] += parameters[0] * wire[CURRENT]
    elif kind == 3.0:
        wire[FORCE] += parameters[0] * wire[TIME]
    elif kind == 4.0:
        wire[FORCE] += parameters[0] * abs(wire[DRIVE]) ** parameters[2]
    else:
        wire[FORCE] += parameters[0] * (1.0 - math.exp(-wire[TIME] / parameters[2]))


def _with_drive(values: Values) -> list[Step]:
    return [Step("offset", Phase.SENSOR, offset_step, np.array([values["rate"], 0.0]))]


def _with_square(values: Values) -> list[Step]:
    return [
        Step("offset", Phase.SENSOR, offset_step, np.array([values["rate"], 0.0])),
        Step("offset-square", Phase.SENSOR, offset_step, np.array([values["square"], 1.0])),
    ]


def _with_lag(values: Values) -> list[Step]:
    return [Step("offset", Phase.SENSOR, offset_step, np.array([values["rate"], 2.0]))]


def _drift(values: Values) -> list[Step]:
    return [Step("drift", Phase.SENSOR, offset_step, np.array([values["rate"], 3.0]))]


def _with_power(values: Values) -> list[Step]:
    return [Step("offset", Phase.SENSOR, offset_step, np.array([values["rate"], 4.0, values["power"]]))]


def _warming(values: Values) -> list[Step]:
    return [Step("drift", Phase.SENSOR, offset_step, np.array([values["rise"], 5.0, values["warming_time"]]))]


_RATE = amplitude("rate", "N/drive", "offset for each unit of drive", "force/drive", -5.0, 5.0)

EFFECT = Effect(
    name="offset",
    summary="the zero of the load cell changes from test to test or with the drive",
    physics="The coil current couples into the bridge of the load cell, or its amplifier is zeroed again between "
    "tests.",
    remedy="Zero the load cell before every test with the coil current on; separate the cables of coil and bridge.",
    residual="A constant that differs between tests or depends on the drive, but not on the motion.",
    source="sensor practice",
    acts_on="force",
    forms=(
        EffectForm("with-drive", "F + b i", (_RATE,), _with_drive, {"rate": 0}),
        EffectForm(
            "with-drive-squared",
            "F + b i + c i^2",
            (_RATE, amplitude("square", "N/drive^2", "curvature of it", "force/drive^2", -5.0, 5.0)),
            _with_square,
            {"rate": 0, "square": 1},
        ),
        EffectForm("with-effective-drive", "F + b u", (_RATE,), _with_lag, {"rate": 0}),
        EffectForm(
            "drift",
            "F + b t",
            (amplitude("rate", "N/s", "drift of the zero", "force/time", -5.0, 5.0),),
            _drift,
            {"rate": 0},
        ),
    ),
    refinements=(
        EffectForm(
            "with-drive-power",
            "F + b |i|^p",
            (
                amplitude("rate", "N/drive^p", "offset at a drive of 1 A or 1 V", "force/drive", -5.0, 5.0),
                shape("power", "1", "power of the drive", "one", 0.5, 3.0, (1.5,)),
            ),
            _with_power,
            {"rate": 0},
        ),
        EffectForm(
            "warming",
            "F + b (1 - exp(-t/T))",
            (
                amplitude("rise", "N", "offset of the warm load cell", "force", -2.0, 2.0),
                shape("warming_time", "s", "time constant of the warming", "time", 0.02, 5.0, (0.2, 1.0)),
            ),
            _warming,
            {"rise": 0},
        ),
    ),
    sensor=True,
    separated_by={
        "asymmetry": Separation("constant drive at several speeds; rest at several drives", ("constants", "rest"))
    },
)
