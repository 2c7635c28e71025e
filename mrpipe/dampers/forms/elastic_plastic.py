"""Elastic-plastic friction with a constant stiffness; its force does not jump when the yield force changes."""

from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import GAMMA_SHARE, INITIAL_STIFFNESS, displacement_between, follow_hysteresis, parts_of
from mrpipe.dampers.parameters import Values, shape
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_FORCE, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def elastic_plastic_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: stiffness [N/m], exponent, gamma share. State: last displacement [m], force of the element [N],
    last velocity [m/s], last yield force [N].

    The force is the state. When the yield force rises, the element first has to be strained to the new yield force.
    When the yield force falls below the force, the element slips until its force is the yield force. A long interval is
    divided, because the yield force can change while the element is strained.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    # a lower limit keeps the ratio to the yield force defined if the damper has no yield force
    limit = max(wire[YIELD_FORCE], 1e-9)
    if wire[FIRST] > 0.5:
        state[0] = x
        state[1] = 0.0
        state[2] = v
        state[3] = limit
    count = parts_of(dt)
    share, place, speed = 0.0, state[0], state[2]
    for part in range(count):
        end = (part + 1.0) / count
        after = displacement_between(end, state[0], state[2], x, v, dt)
        speed_after = state[2] + end * (v - state[2])
        held = state[3] + end * (limit - state[3])
        share = min(max(state[1] / held, -1.0), 1.0)
        share = follow_hysteresis(
            share, place, speed, after, speed_after, dt / count, held / parameters[0], parameters[2], parameters[1]
        )
        state[1] = share * held
        place, speed = after, speed_after
    state[0] = x
    state[2] = v
    state[3] = limit
    wire[HYSTERESIS] = share


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["initial_stiffness"], values["exponent"], values.get("gamma_share", 0.5)])
    return [Step("elastic-plastic", Phase.HYSTERESIS, elastic_plastic_step, numbers, state_size=4)]


FORM = BaseForm(
    name="elastic-plastic",
    summary="F' = k v (1 - |F/F_y(u)|^n (g + (1 - g) sign(F v))); F does not jump with the current",
    source="Prandtl 1928, Z. angew. Math. Mech. 8, 85-106 (n without limit); Dahl 1968, TOR-158(3107-18) (g = n = 1); "
    "Ozdemir 1976, PhD thesis, Berkeley (g = 1)",
    parameters=(
        INITIAL_STIFFNESS,
        shape("exponent", "1", "sharpness of the change from elastic to plastic", "one", 1.0, 50.0, (4.0, 20.0)),
        GAMMA_SHARE,
    ),
    steps=_steps,
    coupled=True,
    family="bouc-wen",
)
