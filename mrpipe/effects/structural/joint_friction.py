"""Joint friction: bolts and column feet slip and stick, and dissipate energy at any amplitude."""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math

from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Separation, amplitude, shape
from mrpipe.effects.structural.contract import STEP_SIGNATURE, StructuralEffect, StructuralForm


@njit(STEP_SIGNATURE, cache=True)
def slipping_step(
    position: float, rate: float, state: FloatArray, parameters: FloatArray, dt: float, out: FloatArray
) -> None:
    """Springs in parallel that slip at their limits (Iwan); parameters: slip displacement [m], number of springs.

    The limits of several springs are 1/2, 1, 2 and 4 times the slip displacement, so that slip begins gradually.
    `state` is the drift of the step before and the deflection of each spring.
    """
    moved = position - state[0]
    state[0] = position
    springs = int(parameters[1])
    limit = parameters[0] if springs == 1 else 0.5 * parameters[0]
    total = 0.0
    for k in range(springs):
        stretched = min(max(state[1 + k] + moved, -limit), limit)
        state[1 + k] = stretched
        total += stretched / limit / springs
        limit *= 2.0
    out[0] = total


@njit(STEP_SIGNATURE, cache=True)
def coulomb_step(
    position: float, rate: float, state: FloatArray, parameters: FloatArray, dt: float, out: FloatArray
) -> None:
    """Coulomb friction smoothed by v/(|v| + v0), and by 2/pi atan; parameters: speed v0 [m/s]."""
    out[0] = 2.0 / math.pi * math.atan(rate / parameters[0])


_FORCE = amplitude("force", "N", "friction force of a storey", "force", 0.0, 10.0)

EFFECT = StructuralEffect(
    name="joint-friction",
    summary="a force of constant size that opposes the rate of the drift",
    physics="Bolted joints and column feet slip: a storey resists with a friction force at any amplitude.",
    remedy="Tighten or weld the joints of the named storeys; declare friction force and slip displacement.",
    residual="A step over the drift rate of a storey, independent of the amplitude; the damping ratio falls with "
    "rising amplitude.",
    source="Jenkins (1962), Iwan (1966); Coulomb friction",
    acts_on="storey",
    forms=(
        StructuralForm(
            "slipping-spring",
            "F clip(drift since reversal / x_s)",
            (
                shape(
                    "slip_displacement",
                    "m",
                    "drift at which the joint slips",
                    "stroke",
                    1e-4,
                    0.2,
                    (0.001, 0.01, 0.05, 0.15),
                ),
            ),
            (_FORCE,),
            slipping_step,
            2,
            constants=(1.0,),
        ),
        StructuralForm(
            "gradual-slip",
            "four slipping springs with limits of 1/2 to 4 x_s",
            (
                shape(
                    "slip_displacement", "m", "drift around which slip begins", "stroke", 1e-4, 0.1, (0.001, 0.01, 0.05)
                ),
            ),
            (_FORCE,),
            slipping_step,
            5,
            constants=(4.0,),
        ),
        StructuralForm(
            "coulomb",
            "F 2/pi atan(rate/v0)",
            (
                shape(
                    "rounding_speed",
                    "m/s",
                    "drift rate over which the force reverses",
                    "speed",
                    1e-4,
                    0.2,
                    (0.005, 0.04),
                ),
            ),
            (_FORCE,),
            coulomb_step,
        ),
    ),
    separated_by={
        "cubic-stiffness": Separation(
            "free decay from two amplitudes: friction ends the decay, a cubic stiffness shifts the frequency"
        ),
        "base-rocking": Separation("free decay to rest: friction stops the motion abruptly"),
        "yielding": Separation("the same motion at a tenth of the amplitude: a joint still slips there"),
    },
)
