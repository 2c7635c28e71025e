"""Regularised Bingham model."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import Step
from mrpipe.dampers.viscoplastic import velocity_sign


def _steps(values: Values) -> list[Step]:
    return [velocity_sign(values.get("transition_velocity", 0.0))]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    scale = values.get("transition_velocity", 0.0)
    return rounded_sum(np.tanh(at.speed / scale) if scale > 0.0 else np.ones_like(at.speed), at)


FORM = BaseForm(
    name="bingham",
    summary="Bingham (6.1): F_y tanh(v/v_t) parallel to a dashpot; a jump for v_t = 0",
    source="Stanway, Sproston, Stevens 1985; Papanastasiou 1987, J. Rheol. 31, 385-404 (regularisation)",
    parameters=(
        shape(
            "transition_velocity",
            "m/s",
            "speed over which the sign of the velocity is rounded",
            "speed",
            1e-4,
            1.0,
            (0.01, 0.1),
        ),
    ),
    steps=_steps,
    post_yield=_post_yield,
)
