"""Parallel elastic-plastic elements with a distribution of yield displacements.

Each element is a spring with a slider. All springs together have the constant stiffness k, and all sliders together the
yield force F_y(u). A share s of the stiffness belongs to elements whose yield displacement over the mean one is at most
r + (1 - r) g(s), where g is proportional to s^a. Iwan's distribution is uniform between two limits (a = 1). A damper
that is elastic up to its first slip has a least share r above 0. With r = 0, a = 0 is one elastic-plastic element, and
a = 1/(chi + 1) gives the density phi^chi of Segalman without its delta function. Discrete elements at equal steps of s
represent the distribution.
"""

from __future__ import annotations

import numpy as np
from numba import float64, njit, void

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import INITIAL_STIFFNESS, displacement_between, parts_of, turning_share
from mrpipe.dampers.parameters import Parameter, Values, shape
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_FORCE, Phase, Step

ELEMENTS = 24
"""Number of elements, which brings the force within 0.2 % of that of many elements."""

_HEAD = 3
"""Number of states before the deformations of the elements."""


@njit(void(float64[::1], float64[::1], float64, float64), cache=True)
def _move(state: FloatArray, parameters: FloatArray, increment: float, scale: float) -> None:
    # a slider keeps the deformation of its spring within the yield displacement
    for place in range(ELEMENTS):
        limit = scale * parameters[1 + place]
        state[_HEAD + place] = min(max(state[_HEAD + place] + increment, -limit), limit)


@njit(STEP_SIGNATURE, cache=True)
def iwan_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: stiffness of all elements [N/m], then the yield displacement of each over the mean one. State: last
    displacement [m], last velocity [m/s], last yield force [N], deformation of the spring of each element [m].

    A long interval is divided, because the yield force can change while the elements are strained.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    strength = max(wire[YIELD_FORCE], 1e-9)
    stiffness = parameters[0]
    if wire[FIRST] > 0.5:
        for place in range(_HEAD + ELEMENTS):
            state[place] = 0.0
        state[0] = x
        state[1] = v
        state[2] = strength
    turn = turning_share(state[0], state[1], x, v, dt)
    parts = parts_of(dt)
    begin, position = 0.0, state[0]
    for part in range(parts):
        end = (part + 1.0) / parts
        scale = (state[2] + end * (strength - state[2])) / stiffness
        # at most two pieces: before and after the turning point of the motion
        for _ in range(2):
            until = turn if begin < turn < end else end
            after = displacement_between(until, state[0], state[1], x, v, dt)
            if until > begin:
                _move(state, parameters, after - position, scale)
            begin, position = until, after
    state[0] = x
    state[1] = v
    state[2] = strength
    total = 0.0
    for place in range(ELEMENTS):
        total += state[_HEAD + place]
    wire[HYSTERESIS] = stiffness * total / (ELEMENTS * strength)


def yield_displacements(spread: float, least_share: float = 0.0) -> FloatArray:
    """Return the yield displacement of each element over the mean one, shape (`ELEMENTS`,)."""
    shares = (np.arange(ELEMENTS) + 0.5) / ELEMENTS
    relative = shares**spread
    return np.asarray(least_share + (1.0 - least_share) * relative / np.mean(relative), dtype=np.float64)


def _steps(values: Values) -> list[Step]:
    relative = yield_displacements(values["spread"], values.get("least_share", 0.0))
    numbers = np.array([values["initial_stiffness"], *relative])
    return [Step("iwan", Phase.HYSTERESIS, iwan_step, numbers, state_size=_HEAD + ELEMENTS)]


FORM = BaseForm(
    name="iwan",
    summary="Elastic-plastic elements in parallel, their yield displacements proportional to r + (1 - r) (a + 1) s^a "
    "for s from 0 to 1",
    source="Iwan 1966, J. Appl. Mech. 33, 893-900; Segalman 2005, J. Appl. Mech. 72, 752-760",
    parameters=(
        INITIAL_STIFFNESS,
        shape("spread", "1", "exponent of the distribution of the yield displacements", "one", 1e-3, 6.0, (1.0, 0.1)),
        Parameter("least_share", "1", "r: least yield displacement over the mean one", "one", 0.0, 1.0, (0.0, 0.3)),
    ),
    steps=_steps,
    coupled=True,
)
