"""Saturation: beyond some current the field no longer grows."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, DRIVE, FIRST, STEP_SIGNATURE, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Separation, Values, shape


@njit(STEP_SIGNATURE, cache=True)
def saturation_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: inverse of the saturation level [1/A], kind (0 sharp, 1 rounded, 2 tanh), exponent."""
    u = wire[CURRENT]
    inverse = parameters[0]
    if inverse <= 0.0:
        return
    ratio = u * inverse
    if parameters[1] == 0.0:
        limited = min(max(ratio, -1.0), 1.0)
    elif parameters[1] == 1.0:
        power = parameters[2]
        limited = ratio / (1.0 + abs(ratio) ** power) ** (1.0 / power)
    else:
        limited = math.tanh(ratio)
    wire[CURRENT] = limited / inverse


@njit(STEP_SIGNATURE, cache=True)
def command_limit_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: inverse of the largest command [1/A]."""
    inverse = parameters[0]
    if inverse > 0.0:
        wire[DRIVE] = min(max(wire[DRIVE], -1.0 / inverse), 1.0 / inverse)
        wire[CURRENT] = wire[DRIVE]


@njit(STEP_SIGNATURE, cache=True)
def soft_driver_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: inverse of the largest command [1/A], sharpness of the knee."""
    inverse, power = parameters[0], parameters[1]
    if inverse > 0.0:
        ratio = wire[DRIVE] * inverse
        wire[DRIVE] = ratio / (1.0 + abs(ratio) ** power) ** (1.0 / power) / inverse
        wire[CURRENT] = wire[DRIVE]


@njit(STEP_SIGNATURE, cache=True)
def slewing_driver_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: inverse of the largest command [1/A], largest rate [A/s]. State: output of the driver."""
    inverse = parameters[0]
    wanted = wire[DRIVE]
    if inverse > 0.0:
        wanted = min(max(wanted, -1.0 / inverse), 1.0 / inverse)
    if wire[FIRST] > 0.5:
        state[0] = wanted
    change = parameters[1] * dt
    state[0] += min(max(wanted - state[0], -change), change)
    wire[DRIVE] = state[0]
    wire[CURRENT] = state[0]


def _step(inverse: float, kind: float, power: float = 6.0) -> list[Step]:
    return [Step("saturation", Phase.CURRENT_EFFECT, saturation_step, np.array([inverse, kind, power]))]


def _sharp(values: Values) -> list[Step]:
    return _step(values["inverse_limit"], 0.0)


def _smooth(values: Values) -> list[Step]:
    return _step(values["inverse_limit"], 1.0)


def _knee(values: Values) -> list[Step]:
    return _step(values["inverse_limit"], 1.0, values["exponent"])


def _command(values: Values) -> list[Step]:
    # before the lag of the base form: currents that the driver never supplies
    return [Step("command-limit", Phase.MOTION, command_limit_step, np.array([values["inverse_limit"]]))]


def _soft_driver(values: Values) -> list[Step]:
    numbers = np.array([values["inverse_limit"], values["exponent"]])
    return [Step("soft-driver", Phase.MOTION, soft_driver_step, numbers)]


def _slewing(values: Values) -> list[Step]:
    numbers = np.array([values["inverse_limit"], values["rate"]])
    return [Step("slewing-driver", Phase.MOTION, slewing_driver_step, numbers, 1)]


def _tanh(values: Values) -> list[Step]:
    return _step(values["inverse_limit"], 2.0)


_INVERSE = Parameter(
    "inverse_limit",
    "1/drive",
    "inverse of the drive at saturation",
    "one/drive",
    0.5,
    6.0,
    (1.15, 1.6, 2.5),
    "level",
    True,
)
_SOFT = Parameter(
    "inverse_limit",
    "1/drive",
    "inverse of the drive at saturation",
    "one/drive",
    0.05,
    6.0,
    (0.4, 0.9, 1.6),
    "level",
    True,
)
_SHARPNESS = shape("exponent", "1", "sharpness of the knee", "one", 1.0, 40.0, (4.0, 12.0))

EFFECT = Effect(
    name="saturation",
    summary="the force no longer rises beyond some drive",
    physics="The steel of the flux path saturates, or the driver cannot supply the commanded current.",
    remedy="Record the coil current; measure constant drives up to the largest; lower the limit of the controller.",
    residual="Proportional to the yield force, negative at the largest drives and positive at medium ones; "
    "independent of the past of the drive.",
    source="B-H curve of the flux path",
    acts_on="effective drive",
    law_of_drive=True,
    forms=(
        EffectForm("sharp", "min(u, us)", (_INVERSE,), _sharp),
        EffectForm("smooth", "u/(1 + (u/us)^6)^(1/6)", (_INVERSE,), _smooth),
        EffectForm("tanh", "us tanh(u/us)", (_SOFT,), _tanh),
        EffectForm("driver", "min(command, us), before the lag", (_INVERSE,), _command),
        EffectForm(
            "soft-driver",
            "command/(1 + (command/us)^n)^(1/n), before the lag",
            (_INVERSE, _SHARPNESS),
            _soft_driver,
        ),
    ),
    separated_by={
        "remanence": Separation("current steps up and down", ("steps",)),
        "heating": Separation("constant drives, each started with a cold damper", ("constants",)),
    },
    refinements=(
        EffectForm(
            "knee",
            "u/(1 + (u/us)^n)^(1/n)",
            (_INVERSE, _SHARPNESS),
            _knee,
        ),
        EffectForm(
            "slewing-driver",
            "min(command, us) that changes at a limited rate, before the lag",
            (_INVERSE, shape("rate", "drive/s", "largest rate of change", "drive", 3.0, 3000.0, (30.0, 200.0))),
            _slewing,
        ),
    ),
)
