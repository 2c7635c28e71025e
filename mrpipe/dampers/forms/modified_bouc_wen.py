"""Modified Bouc-Wen model of Spencer et al."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength
from mrpipe.dampers.hysteresis import GAMMA_SHARE, YIELD_DISPLACEMENT, bouc_wen_numbers
from mrpipe.dampers.modified import series_dashpot
from mrpipe.dampers.parameters import Parameter, Values, amplitude, shape
from mrpipe.dampers.plant import Step


def _steps(values: Values) -> list[Step]:
    return series_dashpot(
        *bouc_wen_numbers(values),
        series_viscosity=(values["c1_a"], values.get("c1_b", 0.0)),
        inner_stiffness=values.get("k0", 0.0),
        outer_stiffness=values.get("k1", 0.0),
        rest_displacement=values.get("x0", 0.0),
    )


def _post_yield(values: Values, at: Strength) -> FloatArray:
    # the springs are left out, because they need the displacement. Below the speed at which the series dashpot carries
    # the yield force, only this dashpot moves
    series = values["c1_a"] + values.get("c1_b", 0.0) * at.drive
    total = at.yield_force + at.viscosity * at.speed
    return np.asarray(np.minimum(series * at.speed, series * total / (at.viscosity + series)), dtype=np.float64)


FORM = BaseForm(
    name="modified-bouc-wen",
    summary="Bouc-Wen element with a dashpot c1 in series, springs k0 (inner) and k1 (outer)",
    source="Spencer, Dyke, Sain, Carlson 1997, J. Eng. Mech. 123, 230-238",
    parameters=(
        YIELD_DISPLACEMENT,
        GAMMA_SHARE,
        shape("c1_a", "N*s/m", "dashpot in series without drive", "force/speed", 0.1, 3e4, (30.0, 3.0)),
        Parameter(
            "c1_b", "N*s/m/drive", "change of the dashpot with the drive", "force/speed/drive", 0.0, 3e4, (10.0,)
        ),
        shape("k0", "N/m", "spring across the inner element", "force/stroke", 1e-6, 1.0, (0.02,)),
        amplitude("k1", "N/m", "spring across the damper", "force/stroke", 0.0, 10.0),
    ),
    steps=_steps,
    amplitude_steps={"k1": 2},
    post_yield=_post_yield,
    coupled=True,
    known=True,
    springs=("k0", "k1"),
    hysteresis=bouc_wen_numbers,
)
