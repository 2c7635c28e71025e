"""Bouc-Wen model and a second yield force that is reached with speed."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, fully_yielded
from mrpipe.dampers.hysteresis import GAMMA_SHARE, YIELD_DISPLACEMENT, bouc_wen_numbers, hysteresis
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import PART, STEP_SIGNATURE, VELOCITY, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def rounded_part_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: velocity scale [m/s]."""
    wire[PART] = math.tanh(wire[VELOCITY] / parameters[0])


def _steps(values: Values) -> list[Step]:
    part = Step("rounded-part", Phase.HYSTERESIS, rounded_part_step, np.array([values["velocity_scale"]]))
    return [hysteresis(*bouc_wen_numbers(values)), part]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return fully_yielded(values, at) + at.part_force * np.tanh(at.speed / values["velocity_scale"])


FORM = BaseForm(
    name="rounded-yield",
    summary="Bouc-Wen hysteresis and F_p(u) tanh(v/v0): the yield force rises with speed, then levels off",
    source="Kwok et al. 2006, Sens. Actuators A 132, 441-451 (tanh); parallel to (2.1) as in Wereley et al. 1998",
    parameters=(
        YIELD_DISPLACEMENT,
        GAMMA_SHARE,
        shape(
            "velocity_scale", "m/s", "speed at which the second part is reached", "speed", 2e-3, 3.0, (0.1, 0.3, 0.03)
        ),
    ),
    steps=_steps,
    post_yield=_post_yield,
    part="rounded_force",
    family="rate-dependent-yield",
    hysteresis=bouc_wen_numbers,
)
