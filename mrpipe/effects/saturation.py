"""Saturation: beyond some current the field grows no more."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import CURRENT, STEP_SIGNATURE, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Parameter, Values


@njit(STEP_SIGNATURE, cache=True)
def saturation_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: inverse of the saturation level [1/A], kind (0 sharp, 1 smooth, 2 tanh)."""
    u = wire[CURRENT]
    inverse = parameters[0]
    if inverse <= 0.0:
        return
    ratio = u * inverse
    if parameters[1] == 0.0:
        limited = min(max(ratio, -1.0), 1.0)
    elif parameters[1] == 1.0:
        limited = ratio / (1.0 + abs(ratio) ** 6) ** (1.0 / 6.0)
    else:
        limited = math.tanh(ratio)
    wire[CURRENT] = limited / inverse


def _step(inverse: float, kind: float) -> list[Step]:
    return [Step("saturation", Phase.CURRENT_EFFECT, saturation_step, np.array([inverse, kind]))]


def _sharp(values: Values) -> list[Step]:
    return _step(values["inverse_limit"], 0.0)


def _smooth(values: Values) -> list[Step]:
    return _step(values["inverse_limit"], 1.0)


def _tanh(values: Values) -> list[Step]:
    return _step(values["inverse_limit"], 2.0)


_INVERSE = Parameter(
    "inverse_limit",
    "1/drive",
    "one over the drive of saturation",
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
    "one over the drive of saturation",
    "one/drive",
    0.05,
    6.0,
    (0.4, 0.9, 1.6),
    "level",
    True,
)

EFFECT = Effect(
    name="saturation",
    summary="beyond some drive the force rises no more",
    physics="The steel of the flux path saturates, or the driver cannot bring the commanded current.",
    remedy="Record the coil current; measure constant drives up to the largest; lower the limit of the controller.",
    source="B-H curve of the flux path",
    acts_on="effective drive",
    forms=(
        EffectForm("sharp", "min(u, us)", (_INVERSE,), _sharp),
        EffectForm("smooth", "u/(1 + (u/us)^6)^(1/6)", (_INVERSE,), _smooth),
        EffectForm("tanh", "us tanh(u/us)", (_SOFT,), _tanh),
    ),
    separated_by={"remanence": "current steps up and down", "heating": "constant drives, each begun cold"},
)
