"""LuGre model for MR dampers."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import YIELD_DISPLACEMENT, hysteresis
from mrpipe.dampers.parameters import Values, amplitude
from mrpipe.dampers.plant import CURRENT, FORCE, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def bristle_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: damping of the bristles [N s/m], and whether it is per unit of the drive."""
    speed = wire[VELOCITY]
    damping = parameters[0] * wire[CURRENT] if parameters[1] > 0.0 else parameters[0]
    wire[FORCE] += damping * (speed - abs(speed) * wire[HYSTERESIS])


def _numbers(values: Values) -> tuple[float, float, float]:
    return values["yield_displacement"], 1.0, 1.0


def _steps(values: Values) -> list[Step]:
    bristles = [
        Step("bristle-damping", Phase.FORCE_EFFECT, bristle_step, np.array([values.get(name, 0.0), kind]))
        for name, kind in (("sigma_1", 0.0), ("sigma_1_rate", 1.0))
    ]
    return [hysteresis(*_numbers(values)), *bristles]


FORM = BaseForm(
    name="lugre",
    summary="bristles z' = v - |v| z/x_y with internal damping: F_y z/x_y + (sigma_1 + sigma_1u u) z' + c0 v",
    source="Jimenez and Alvarez-Icaza 2005, Struct. Control Health Monit. 12, 91-116; Canudas de Wit et al. 1995",
    parameters=(
        YIELD_DISPLACEMENT,
        amplitude("sigma_1", "N*s/m", "damping of the bristles", "force/speed", 0.0, 50.0),
        amplitude(
            "sigma_1_rate", "N*s/m/drive", "change of the damping with the drive", "force/speed/drive", 0.0, 50.0
        ),
    ),
    steps=_steps,
    amplitude_steps={"sigma_1": 1, "sigma_1_rate": 2},
)
