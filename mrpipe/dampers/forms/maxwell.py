"""Flow with a rounded yield point whose force relaxes, as in a Maxwell element."""

from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.drive import advance_lag
from mrpipe.dampers.form import BaseForm, Strength, rounded_share, rounded_sum
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import FIRST, FORCE, HYSTERESIS, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.dampers.viscoplastic import knee


@njit(STEP_SIGNATURE, cache=True)
def knee_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:  # noqa: ARG001
    """Parameters: velocity scale [m/s], sharpness."""
    wire[HYSTERESIS] = knee(wire[VELOCITY] / parameters[0], parameters[1])


@njit(STEP_SIGNATURE, cache=True)
def relaxing_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: relaxation time [s]. State: force [N], last force without relaxation [N].

    Exact for a force without relaxation that is linear between two samples.
    """
    force = wire[FORCE]
    if wire[FIRST] > 0.5:
        state[0] = force
    else:
        state[0] = advance_lag(state[0], state[1], force, dt / parameters[0])
    state[1] = force
    wire[FORCE] = state[0]


def _steps(values: Values) -> list[Step]:
    flow = np.array([values["velocity_scale"], values["sharpness"]], dtype=np.float64)
    time = np.array([values["relaxation_time"]], dtype=np.float64)
    return [
        Step("rounded-flow", Phase.HYSTERESIS, knee_step, flow),
        Step("relaxation", Phase.SENSOR, relaxing_step, time, 2, filters_force=True),
    ]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum(rounded_share(at.speed, values["velocity_scale"], values["sharpness"]), at)


FORM = BaseForm(
    name="maxwell",
    summary="F + tau F' = F_y r/(1 + |r|^m)^(1/m) + c0 v, r = v/v0: the force relaxes with a constant time, as that of "
    "a dashpot in series with a spring",
    source="Makris, Burton, Hill, Jordan 1996, J. Eng. Mech. 122, 1003-1011 (Maxwell element); Ramberg, Osgood 1943 "
    "(sharpness)",
    parameters=(
        shape("relaxation_time", "s", "tau: viscosity over stiffness", "one", 1e-4, 0.3, (0.01, 0.04)),
        shape("velocity_scale", "m/s", "velocity at which the flow yields", "speed", 1e-3, 3.0, (0.05, 0.3)),
        shape("sharpness", "1", "m: 2 is a square root, infinity a sharp yield point", "one", 0.7, 12.0, (2.0,)),
    ),
    steps=_steps,
    post_yield=_post_yield,
)
