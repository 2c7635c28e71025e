"""Bouc-Wen hysteresis and a second yielding part that shears with speed, each with its own law of the drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, fully_yielded
from mrpipe.dampers.hysteresis import GAMMA_SHARE, YIELD_DISPLACEMENT, bouc_wen_numbers, hysteresis
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import PART, STEP_SIGNATURE, Phase, Step
from mrpipe.dampers.viscoplastic import follow_dashpot


@njit(STEP_SIGNATURE, cache=True)
def dashpot_part_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: spring rate [1/m], velocity scale [m/s]. State: atanh z, last velocity."""
    wire[PART] = follow_dashpot(wire, state, parameters[0], parameters[1], dt)


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["spring_rate"], values["velocity_scale"]])
    part = Step("dashpot-part", Phase.HYSTERESIS, dashpot_part_step, numbers, 2)
    return [hysteresis(*bouc_wen_numbers(values)), part]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return fully_yielded(values, at) + at.part_force * np.tanh(at.speed / values["velocity_scale"])


FORM = BaseForm(
    name="yielding-part",
    summary="Bouc-Wen hysteresis parallel to F_p(u) p, p' = q (v - v0 atanh p)",
    source="Eyring 1936 (saturating dashpot); plug that slips parallel to a layer that shears, as in Phillips 1969",
    parameters=(
        # either part can represent the elastic path after a reversal, so that there are two distant optima
        replace(YIELD_DISPLACEMENT, starts=(0.05, 0.003)),
        GAMMA_SHARE,
        shape("spring_rate", "1/m", "stiffness over the part's force", "one/stroke", 2.0, 1500.0, (40.0, 200.0, 900.0)),
        shape("velocity_scale", "m/s", "speed of the part's dashpot", "speed", 5e-3, 1.0, (0.12, 0.04)),
    ),
    steps=_steps,
    post_yield=_post_yield,
    part="part_force",
    family="rate-dependent-yield",
    hysteresis=bouc_wen_numbers,
)
