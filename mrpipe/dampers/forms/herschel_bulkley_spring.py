"""Herschel-Bulkley valve with a spring in series, and friction of the seals."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_share
from mrpipe.dampers.hysteresis import SPRING_STIFFNESS
from mrpipe.dampers.parameters import Values, constant, shape
from mrpipe.dampers.plant import Step
from mrpipe.dampers.seal import SEAL_PARAMETERS, seal_friction
from mrpipe.dampers.series_valve import HERSCHEL_BULKLEY, series_valve
from mrpipe.dampers.viscoplastic import outer_velocity


def _steps(values: Values) -> list[Step]:
    valve = series_valve(
        HERSCHEL_BULKLEY,
        values["spring_stiffness"],
        values["velocity_scale"],
        values["reference_velocity"],
        values["velocity_exponent"],
        values.get("sharpness", 2.0),
    )
    return [valve, outer_velocity(), seal_friction(values)]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    rounded = np.sqrt(at.speed**2 + values["velocity_scale"] ** 2)
    thinning = (rounded / values["reference_velocity"]) ** (values["velocity_exponent"] - 1.0)
    share = rounded_share(at.speed, values["velocity_scale"], values.get("sharpness", 2.0))
    flow = at.yield_force * share + at.viscosity * at.speed * thinning
    return np.asarray(flow + values.get("seal_friction", 0.0), dtype=np.float64)


FORM = BaseForm(
    name="herschel-bulkley-spring",
    summary="Herschel-Bulkley valve F_y sign(w') + c0 v_ref (|w'|/v_ref)^n sign(w') with a rounded yield point, a "
    "spring in series, and friction of the seals in parallel",
    source="Sims, Peel, Stanway, Johnson, Bullough 2000, J. Sound Vib. 229, 207-227; Lee and Wereley 1999, J. Intell. "
    "Mater. Syst. Struct. 10, 761-769 (Herschel-Bulkley flow in a valve); Ramberg, Osgood 1943 (sharpness)",
    parameters=(
        SPRING_STIFFNESS,
        shape("velocity_scale", "m/s", "velocity at which the valve yields", "speed", 1e-4, 1.0, (0.01, 0.1)),
        shape("velocity_exponent", "1", "power of the velocity in the viscous force", "one", 0.1, 2.0, (0.7,)),
        shape("sharpness", "1", "m: 2 is a square root, infinity a sharp yield point", "one", 1.0, 12.0, (2.0,)),
        constant("reference_velocity", "m/s", "speed for which the viscosity is given", "speed"),
        *SEAL_PARAMETERS,
    ),
    steps=_steps,
    amplitude_steps={"seal_friction": 2},
    post_yield=_post_yield,
    coupled=True,
)
