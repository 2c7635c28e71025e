"""Hysteretic biviscous model whose viscosity before yield is constant."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.hysteresis import ACCELERATION_SCALE, HYSTERESIS_VELOCITY
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import (
    ACCELERATION,
    HYSTERESIS,
    STEP_SIGNATURE,
    VELOCITY,
    VISCOSITY,
    YIELD_FORCE,
    Phase,
    Step,
)
from mrpipe.dampers.viscoplastic import rounded_sign

NUMBERS = ("preyield_viscosity", "hysteresis_velocity", "acceleration_scale")


@njit(STEP_SIGNATURE, cache=True)
def hysteretic_viscosity_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: viscosity before yield minus that after yield [N*s/m], hysteresis velocity [m/s], acceleration scale
    [m/s^2].
    """
    shift = parameters[1] * rounded_sign(wire[ACCELERATION], parameters[2])
    # before yield the whole force is (C + c0) (v - v_h); c0 v is added later
    force = parameters[0] * wire[VELOCITY] - (parameters[0] + wire[VISCOSITY]) * shift
    wire[HYSTERESIS] = min(max(force / max(wire[YIELD_FORCE], 1e-12), -1.0), 1.0)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values[name] for name in NUMBERS])
    return [Step("hysteretic-viscosity", Phase.HYSTERESIS, hysteretic_viscosity_step, numbers)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    before, late = values["preyield_viscosity"], values["hysteresis_velocity"]
    force = np.maximum(at.yield_force, 1e-12)
    both = [
        np.clip((before * at.speed - side * (before + at.viscosity) * late) / force, -1.0, 1.0) for side in (-1.0, 1.0)
    ]
    return rounded_sum(np.asarray(0.5 * (both[0] + both[1])), at)


FORM = BaseForm(
    name="hysteretic-biviscous-viscosity",
    summary="biviscous with a constant viscosity before yield, its branches shifted by v_h tanh(v'/a0)",
    source="Wereley, Pang, Kamath 1998, J. Intell. Mater. Syst. Struct. 9, 642-649: C_pr and v_0 are constants",
    parameters=(
        shape(
            "preyield_viscosity",
            "N*s/m",
            "viscosity before yield minus that after yield",
            "force/speed",
            0.8,
            2000.0,
            (20.0, 5.0),
        ),
        HYSTERESIS_VELOCITY,
        ACCELERATION_SCALE,
    ),
    steps=_steps,
    post_yield=_post_yield,
    coupled=True,
    family="biviscous",
    begins_with="hysteretic-biviscous",
)
