"""Parallel elastic-plastic elements with a distribution of yield displacements.

Each element is a spring with a slider, which keeps the deformation of the spring within the yield displacement of the
element. The stiffness of the elements whose yield displacement is y, relative to the largest one, is distributed as
y^chi between r and 1. chi = 0 is Iwan's uniform distribution between two limits, r = 0 gives the density of Segalman
without its delta function, and r = 1 is one elastic-plastic element. The yield displacements are constant (p = 0), grow
in proportion to the yield force, so that the stiffness is constant (p = 1), or lie in between. Discrete elements
represent the distribution.
"""

from __future__ import annotations

import math

import numpy as np
from numba import float64, njit, void

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import YIELD_DISPLACEMENT, displacement_between, parts_of, turning_share
from mrpipe.dampers.parameters import Parameter, Values, constant, shape
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, HYSTERESIS, STEP_SIGNATURE, VELOCITY, YIELD_FORCE, Phase, Step

ELEMENTS = 24
"""Number of elements, which brings the force within 0.2 % of that of many elements."""

_GRID = 241
"""Numerical technique: points at which the density of the distribution is integrated."""

_HEAD = 3
"""Number of states before the deformations of the elements, and of parameters before their numbers."""


@njit(void(float64[::1], float64[::1], float64, float64), cache=True)
def _move(state: FloatArray, parameters: FloatArray, increment: float, scale: float) -> None:
    # a slider keeps the deformation of its spring within the yield displacement
    for place in range(ELEMENTS):
        limit = scale * parameters[_HEAD + place]
        state[_HEAD + place] = min(max(state[_HEAD + place] + increment, -limit), limit)


@njit(STEP_SIGNATURE, cache=True)
def iwan_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: mean yield displacement [m] at the reference force, growth, reference force [N], then the yield
    displacement of each element over the mean one, and its share of the stiffness. State: last displacement [m], last
    velocity [m/s], last mean yield displacement [m], deformation of the spring of each element [m].

    A long interval is divided if the yield displacements change while the elements are strained.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    ratio = max(wire[YIELD_FORCE] / parameters[2], 1e-9)
    mean = max(parameters[0] * ratio ** parameters[1], 1e-15)
    if wire[FIRST] > 0.5:
        for place in range(_HEAD + ELEMENTS):
            state[place] = 0.0
        state[0] = x
        state[1] = v
        state[2] = mean
    turn = turning_share(state[0], state[1], x, v, dt)
    parts = 1 if mean == state[2] else parts_of(dt)
    begin, position = 0.0, state[0]
    for part in range(parts):
        end = (part + 1.0) / parts
        scale = state[2] + end * (mean - state[2])
        # at most two pieces: before and after the turning point of the motion
        for _ in range(2):
            until = turn if begin < turn < end else end
            after = displacement_between(until, state[0], state[1], x, v, dt)
            if until > begin:
                _move(state, parameters, after - position, scale)
            begin, position = until, after
    state[0] = x
    state[1] = v
    state[2] = mean
    total = 0.0
    for place in range(ELEMENTS):
        total += parameters[_HEAD + ELEMENTS + place] * state[_HEAD + place]
    wire[HYSTERESIS] = total / mean


def elements(exponent: float, least_share: float) -> tuple[FloatArray, FloatArray]:
    """Return the yield displacement of each element over the mean one, and its share of the stiffness.

    The elements divide the mean of the cumulative stiffness and of the cumulative yield force into equal parts, because
    elements with a large yield displacement and little stiffness can hold most of the force.

    Parameters
    ----------
    exponent
        Exponent chi of the density of the stiffness.
    least_share
        Least yield displacement over the largest one.

    Returns
    -------
    Two arrays of shape (`ELEMENTS`,).
    """
    if least_share > 1.0 - 1e-6:
        return np.ones(ELEMENTS), np.full(ELEMENTS, 1.0 / ELEMENTS)
    logarithm = np.linspace(math.log(least_share), 0.0, _GRID)
    sums = []
    for power in (exponent + 1.0, exponent + 2.0):
        density = np.exp(power * (logarithm - logarithm[-1 if power > 0.0 else 0]))
        total = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
        sums.append(total / total[-1])
    mixed = 0.5 * (sums[0] + sums[1])
    at = np.linspace(0.0, 1.0, ELEMENTS + 1)
    stiffness, force = (np.diff(np.interp(at, mixed, total)) for total in sums)
    return np.asarray(force / stiffness, dtype=np.float64), np.asarray(stiffness, dtype=np.float64)


def _steps(values: Values) -> list[Step]:
    head = [values["yield_displacement"], values["growth"], values["reference_force"]]
    numbers = np.concatenate([head, *elements(values["density_exponent"], values["least_share"])])
    return [Step("iwan", Phase.HYSTERESIS, iwan_step, numbers, state_size=_HEAD + ELEMENTS)]


FORM = BaseForm(
    name="iwan",
    summary="Elastic-plastic elements in parallel, their stiffness distributed as y^chi over the yield displacement y "
    "between r and 1, with the mean x_ref (F_y(u)/F_ref)^p",
    source="Iwan 1966, J. Appl. Mech. 33, 893-900; Segalman 2005, J. Appl. Mech. 72, 752-760",
    parameters=(
        YIELD_DISPLACEMENT,
        Parameter("density_exponent", "1", "chi of the density of the stiffness", "one", -4.0, 4.0, (0.0, -1.8)),
        shape("least_share", "1", "r: least yield displacement over the largest one", "one", 5e-3, 0.999, (0.1,)),
        Parameter(
            "growth",
            "1",
            "exponent with which the yield displacements grow with the yield force",
            "one",
            -0.2,
            1.5,
            (0.1, 1.0),
        ),
        constant("reference_force", "N", "yield force for which the yield displacement is given", "force"),
    ),
    steps=_steps,
    coupled=True,
)
