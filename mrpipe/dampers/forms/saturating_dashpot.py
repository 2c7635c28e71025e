"""A spring in series with a dashpot that saturates."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import Step
from mrpipe.dampers.viscoplastic import saturating_dashpot


def _steps(values: Values) -> list[Step]:
    return [saturating_dashpot(values["spring_rate"], values["velocity_scale"])]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum(np.tanh(at.speed / values["velocity_scale"]), at)


FORM = BaseForm(
    name="saturating-dashpot",
    summary="F_y z + c0 v, z' = q (v - v0 atanh z): a spring in series with a saturating dashpot",
    source="Eyring 1936, J. Chem. Phys. 4, 283-291 (dashpot); Maxwell 1867 (series)",
    parameters=(
        shape("spring_rate", "1/m", "stiffness over the yield force", "one/stroke", 0.3, 2000.0, (20.0, 5.0, 80.0)),
        shape("velocity_scale", "m/s", "speed of the dashpot", "speed", 2e-3, 3.0, (0.1, 0.3, 0.03)),
    ),
    steps=_steps,
    post_yield=_post_yield,
    family="rate-dependent-yield",
)
