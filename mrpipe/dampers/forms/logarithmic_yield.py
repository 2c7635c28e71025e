"""Bouc-Wen model whose yield force rises with the logarithm of the speed."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.hysteresis import GAMMA_SHARE, YIELD_DISPLACEMENT, bouc_wen_numbers, hysteresis
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import RATE_YIELD, STEP_SIGNATURE, VELOCITY, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def logarithmic_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: gain, velocity scale [m/s]."""
    wire[RATE_YIELD] *= 1.0 + parameters[0] * math.asinh(abs(wire[VELOCITY]) / parameters[1])


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["gain"], values["velocity_scale"]])
    rising = Step("logarithmic-yield", Phase.COEFFICIENT_EFFECT, logarithmic_step, numbers)
    return [hysteresis(*bouc_wen_numbers(values)), rising]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum(1.0 + values["gain"] * np.arcsinh(at.speed / values["velocity_scale"]), at)


FORM = BaseForm(
    name="logarithmic-yield",
    summary="Bouc-Wen hysteresis, its yield force F_y (1 + g asinh(|v|/v0))",
    source="Eyring 1936, J. Chem. Phys. 4, 283-291 (thermally activated flow)",
    parameters=(
        YIELD_DISPLACEMENT,
        GAMMA_SHARE,
        shape("gain", "1", "relative rise per factor e of the speed", "one", 1e-3, 1e3, (0.1, 10.0)),
        shape("velocity_scale", "m/s", "speed at which the rise begins", "speed", 1e-3, 0.5, (0.02, 0.1)),
    ),
    steps=_steps,
    post_yield=_post_yield,
    family="rate-dependent-yield",
    hysteresis=bouc_wen_numbers,
)
