"""Valve with thermally activated flow and a spring in series, and friction of the seals."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.hysteresis import SPRING_STIFFNESS
from mrpipe.dampers.parameters import Values, constant, shape
from mrpipe.dampers.plant import Step
from mrpipe.dampers.seal import SEAL_PARAMETERS, seal_friction
from mrpipe.dampers.series_valve import EYRING, series_valve
from mrpipe.dampers.viscoplastic import outer_velocity


def _steps(values: Values) -> list[Step]:
    valve = series_valve(EYRING, values["spring_stiffness"], values["velocity_scale"], values["reference_velocity"])
    return [valve, outer_velocity(), seal_friction(values)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    scale = values["velocity_scale"]
    flow = rounded_sum(np.arcsinh(at.speed / scale) / np.arcsinh(values["reference_velocity"] / scale), at)
    return flow + values.get("seal_friction", 0.0)


FORM = BaseForm(
    name="eyring-spring",
    summary="Valve F_y asinh(w'/v0)/asinh(v_ref/v0) + c0 w' with a spring in series, and "
    "friction of the seals in parallel",
    source="Eyring 1936, J. Chem. Phys. 4, 283-291 (flow); Sims, Peel, Stanway, Johnson, Bullough 2000, J. Sound Vib. "
    "229, 207-227 (a valve in series with a spring, and friction in parallel)",
    parameters=(
        SPRING_STIFFNESS,
        shape("velocity_scale", "m/s", "velocity at which the flow begins", "speed", 1e-4, 2.0, (0.02, 0.2)),
        constant("reference_velocity", "m/s", "speed for which the yield force is given", "speed"),
        *SEAL_PARAMETERS,
    ),
    steps=_steps,
    amplitude_steps={"seal_friction": 2},
    post_yield=_post_yield,
    coupled=True,
)
