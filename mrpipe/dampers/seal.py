"""Friction of the seals, which acts in parallel with the fluid and does not depend on the drive."""

from __future__ import annotations

import numpy as np
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.parameters import Values, amplitude, shape
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, FORCE, STEP_SIGNATURE, Phase, Step


@njit(STEP_SIGNATURE, cache=True)
def seal_friction_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:  # noqa: ARG001
    """Parameters: friction [N], displacement over which the seals stick [m]. State: last displacement [m], share.

    Elastic up to the friction, then constant (Prandtl's stop operator), which is exact for any step of the motion.
    """
    x = wire[DISPLACEMENT]
    if wire[FIRST] < 0.5:
        state[1] = min(max(state[1] + (x - state[0]) / parameters[1], -1.0), 1.0)
    state[0] = x
    wire[FORCE] += parameters[0] * state[1]


SEAL_PARAMETERS = (
    amplitude("seal_friction", "N", "friction of the seals at any drive", "force", 0.0, 3.0),
    shape("seal_displacement", "m", "displacement over which the seals stick", "stroke", 5e-4, 0.3, (0.01,)),
)


def seal_friction(values: Values) -> Step:
    """Return the step of the friction of the seals, a force in parallel with the others."""
    numbers = np.array([values.get("seal_friction", 0.0), values.get("seal_displacement", 1e-4)], dtype=np.float64)
    return Step("seal-friction", Phase.FORCE_EFFECT, seal_friction_step, numbers, 2)
