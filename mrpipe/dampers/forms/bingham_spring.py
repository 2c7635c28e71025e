"""Bingham model with a spring in series."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import SPRING_STIFFNESS, displacement_between, parts_of, turning_share
from mrpipe.dampers.parameters import Values
from mrpipe.dampers.plant import (
    DISPLACEMENT,
    FIRST,
    HYSTERESIS,
    OUTER_VELOCITY,
    STEP_SIGNATURE,
    VELOCITY,
    VISCOSITY,
    YIELD_FORCE,
    Phase,
    Step,
)
from mrpipe.dampers.viscoplastic import outer_velocity


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def advance_spring(deformation: float, speed: float, dt: float, yield_deformation: float, relaxation: float) -> float:
    """Return the deformation of the spring [m] after `dt` [s] at a constant speed [m/s]; exact.

    Below the yield deformation the spring takes the whole motion. Beyond it the Bingham element moves by (e -
    e_y)/relaxation, which is a linear equation.
    """
    e, left = deformation, dt
    for _ in range(6):
        if left <= 0.0:
            break
        if abs(e) < yield_deformation or (abs(e) == yield_deformation and e * speed <= 0.0):
            if speed == 0.0:
                break
            target = yield_deformation if speed > 0.0 else -yield_deformation
            needed = (target - e) / speed
            if needed >= left:
                e += speed * left
                break
            e, left = target, left - needed
        sign = 1.0 if e > 0.0 or (e == 0.0 and speed > 0.0) else -1.0
        edge = sign * yield_deformation
        if relaxation < 1e-12:
            if speed * sign >= 0.0:
                return edge
            e = edge
            e += speed * left
            left = 0.0
            e = min(max(e, -yield_deformation), yield_deformation)
            break
        final = edge + speed * relaxation
        if (final - edge) * sign < 0.0 and abs(e) > yield_deformation:
            # the motion has reversed: the element creeps until the force is below its yield force again
            needed = relaxation * math.log((e - final) / (edge - final))
            if needed < left:
                e, left = edge, left - needed
                if abs(e) >= yield_deformation:
                    e = math.copysign(yield_deformation * (1.0 - 1e-12), e)
                continue
        e = final + (e - final) * math.exp(-left / relaxation)
        left = 0.0
    return e


@njit(STEP_SIGNATURE, cache=True)
def bingham_spring_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: stiffness of the spring [N/m]. State: last displacement [m], deformation of the spring [m], last
    velocity [m/s], last yield force [N], last viscosity [N s/m].

    The velocity of the Bingham element replaces that of the rod. A long interval is divided, because the yield force
    can change while the spring is strained.
    """
    x, v = wire[DISPLACEMENT], wire[VELOCITY]
    wire[OUTER_VELOCITY] = v
    stiffness = parameters[0]
    strength = max(wire[YIELD_FORCE], 0.0)
    viscosity = max(wire[VISCOSITY], 0.0)
    if wire[FIRST] > 0.5:
        state[0] = x
        state[1] = 0.0
        state[2] = v
        state[3] = strength
        state[4] = viscosity
    turn = turning_share(state[0], state[2], x, v, dt)
    count = parts_of(dt)
    begin, place, speed = 0.0, state[0], v
    for part in range(count):
        end = (part + 1.0) / count
        limit = (state[3] + end * (strength - state[3])) / stiffness
        relaxation = (state[4] + end * (viscosity - state[4])) / stiffness
        # at most two pieces: before and after the turning point of the motion
        for _ in range(2):
            until = turn if begin < turn < end else end
            after = displacement_between(until, state[0], state[2], x, v, dt)
            length = (until - begin) * dt
            if length > 0.0:
                speed = (after - place) / length
                state[1] = advance_spring(state[1], speed, length, limit, relaxation)
            begin, place = until, after
    state[0] = x
    state[2] = v
    state[3] = strength
    state[4] = viscosity
    force = stiffness * state[1]
    excess = max(abs(force) - strength, 0.0)
    yielded = abs(force) >= strength * (1.0 - 1e-9) and force * speed > 0.0
    wire[HYSTERESIS] = min(max(force / strength, -1.0), 1.0) if strength > 0.0 else 0.0
    if viscosity > 0.0:
        wire[VELOCITY] = math.copysign(excess / viscosity, force)
    else:
        # without viscosity the element takes all of the motion once it yields
        wire[VELOCITY] = speed if yielded else 0.0


def _steps(values: Values) -> list[Step]:
    numbers = np.array([values["spring_stiffness"]])
    return [Step("bingham-spring", Phase.HYSTERESIS, bingham_spring_step, numbers, 5), outer_velocity()]


FORM = BaseForm(
    name="bingham-spring",
    summary="Bingham element F_y sign(w') + c0 w' with a spring in series",
    source="Bingham 1922; Gamota and Filisko 1991, J. Rheol. 35, 399-425 (its limit with a stiff solid)",
    parameters=(SPRING_STIFFNESS,),
    steps=_steps,
    coupled=True,
)
