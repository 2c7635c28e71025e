"""Biviscous model with a constant viscosity before yield: the yield velocity grows with the yield force."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_FORCE, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def biviscous_viscosity_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: viscosity before yield minus viscosity after yield [N*s/m]."""
    # a damper without yield force has no force before yield either
    wire[HYSTERESIS] = min(max(parameters[0] * wire[VELOCITY] / max(wire[YIELD_FORCE], 1e-12), -1.0), 1.0)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["preyield_viscosity"]])
    return [Step("biviscous-viscosity", Phase.HYSTERESIS, biviscous_viscosity_step, numbers)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    share = np.minimum(values["preyield_viscosity"] * at.speed / np.maximum(at.yield_force, 1e-12), 1.0)
    return rounded_sum(np.asarray(share), at)


FORM = BaseForm(
    name="biviscous-viscosity",
    summary="two viscosities, both constant in speed: C v + c0 v before yield, F_y + c0 v beyond it",
    source="Stanway, Sproston, El-Wahed 1996, Smart Mater. Struct. 5, 464-482; Wereley, Pang, Kamath 1998",
    parameters=(
        shape(
            "preyield_viscosity",
            "N*s/m",
            "viscosity before yield minus that after yield",
            "force/speed",
            0.8,
            2000.0,
            (20.0, 5.0, 100.0),
        ),
    ),
    steps=_steps,
    post_yield=_post_yield,
    coupled=True,
    family="biviscous",
    begins_with="biviscous",
)
