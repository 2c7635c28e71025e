"""One step of a device in a benchmark structure: laws, inverses and the implicit Bingham force.

A force that is constant over a step does exactly the work f (x+ - x), so the energy balance closes to rounding for the
device however it jumps. It is found from the velocity in the middle of the step (second order); where the rod turns
round within the step it is the mean of what acts before and after, and where it then sticks it ends at rest.
"""

from __future__ import annotations

import math

import numpy as np
from numba import float64, njit, void

from mrpipe.artifacts import FloatArray

# settings of a run, packed for the kernel
DT = 0
RATIO = 1  # steps a load sample
SAVE = 2  # steps a saved sample
CLASSICAL = 3  # 1: modes are not coupled by damping
LAW = 4
REALISATION = 5
CAPACITY = 6  # N, of all dampers at one position together
COUNT = 7  # dampers side by side at each position
FILTER_RATE = 8  # 1/s of the voltage filter, 0: none
CONTROL_EVERY = 9  # steps a controller sample, at which forces are requested and voltages commanded
FORCE_A = 10  # Bingham of one damper: N, N/V, N s/m, N s/m/V
FORCE_B = 11
VISCOSITY_A = 12
VISCOSITY_B = 13
HIGHEST_VOLTAGE = 14
NEURAL = 15  # 1: inverse by network, 0: by formula
CHAIN_COUNT = 16  # iterations of the predictor-corrector with a damper chain
FADE = 17  # m/s below which the commanded force fades with the velocity, 0: nowhere
SETTINGS = 20

# laws
NONE, KELVIN, FRICTION, LQG, CONSTANT = 0, 1, 2, 3, 4
# realisations
ACTIVE, SEMI_ACTIVE, BINGHAM, CHAIN = 0, 1, 2, 3

# gains of a device
VISCOUS = 0  # c [N s/m]
STIFFNESS = 1  # k_d [N/m]
ALPHA = 2  # FDNS gain [N/m]
VOLTAGE = 3  # of a constant drive
GAINS = 4


@njit(float64(float64, float64, float64, float64, float64), cache=True)
def sliding_force(direction: float, offset: float, viscosity: float, velocity: float, limit: float) -> float:
    """Return the force [N] while the rod slides one way (`direction` 1 or -1): `offset` [N] and a viscous part.

    It only resists, and not beyond the limit.
    """
    resisting = direction * (offset + viscosity * velocity)
    return direction * min(max(resisting, 0.0), limit)


@njit(float64(float64, float64, float64, float64, float64, float64, float64), cache=True)
def dissipative_force(
    push: float, pull: float, viscosity: float, limit: float, velocity: float, free: float, compliance: float
) -> float:
    """Return the mean force of a step of a device that can only resist.

    Moving forward it resists with max(0, push + viscosity v), backward with min(0, -pull + viscosity v), at rest with
    anything between. Where the velocity passes zero within the step the force is that before the reversal for the part
    of the step up to it, and after it what holds the rod, or resists it on its way back: reversals do not wait for the
    end of a step, so that the result depends little on its length.

    Parameters
    ----------
    push, pull, viscosity, limit
        N, N, N s/m, N.
    velocity, free
        At the start of the step, and at its end if there were no force [m/s].
    compliance
        Velocity lost at the end of the step for each newton [m/s/N].
    """
    direction = 1.0 if (velocity if velocity != 0.0 else free) > 0.0 else -1.0
    offset = push if direction > 0.0 else -pull
    change = free - velocity
    damped = 1.0 + 0.5 * viscosity * compliance
    # the mean velocity of the step, with the force in it: v + (change - compliance f)/2
    middle = (velocity + 0.5 * (change - compliance * offset)) / damped
    force = sliding_force(direction, offset, viscosity, middle, limit)
    if direction * (free - compliance * force) >= 0.0:
        return force
    force = sliding_force(direction, offset, viscosity, 0.5 * velocity, limit)
    rate = change - compliance * force
    share = min(max(-velocity / rate, 0.0), 1.0) if rate * velocity < 0.0 else 0.0
    rest = 1.0 - share
    low, high = -min(max(pull, 0.0), limit), min(max(push, 0.0), limit)
    after = change / compliance
    if after < low or after > high:
        # nothing holds it: it slides on, or back
        way = 1.0 if after > high else -1.0
        offset = push if way > 0.0 else -pull
        middle = 0.5 * rest * (change - compliance * offset) / (1.0 + 0.5 * rest * viscosity * compliance)
        after = sliding_force(way, offset, viscosity, middle, limit)
    return share * force + rest * after


@njit(float64(float64, float64, float64[::1]), cache=True)
def inverse_bingham(desired: float, velocity: float, settings: FloatArray) -> float:
    """Return the voltage with which Bingham dampers give the desired force, P4 (6) solved for v, 0 to the highest."""
    if desired * velocity <= 0.0:
        return 0.0
    speed = abs(velocity)
    force = abs(desired) / settings[COUNT]
    volts = (force - settings[FORCE_A] - settings[VISCOSITY_A] * speed) / (
        settings[FORCE_B] + settings[VISCOSITY_B] * speed
    )
    return min(max(volts, 0.0), settings[HIGHEST_VOLTAGE])


@njit(
    float64(float64, float64, float64[:, ::1], float64[::1], float64[:, ::1], float64[::1], float64[::1], float64[::1]),
    cache=True,
)
def network_voltage(
    speed: float,
    force: float,
    first: FloatArray,
    first_bias: FloatArray,
    second: FloatArray,
    second_bias: FloatArray,
    last: FloatArray,
    scales: FloatArray,
) -> float:
    """Return what a network of two hidden layers gives for |v| and |f|; `scales` holds its normalisation.

    scales: input scale (2), input shift (2), output scale, output shift, last bias.
    """
    a = (speed - scales[2]) / scales[0]
    b = (force - scales[3]) / scales[1]
    output = scales[6]
    for j in range(second.shape[0]):
        total = second_bias[j]
        for i in range(first.shape[0]):
            total += second[j, i] * math.tanh(first[i, 0] * a + first[i, 1] * b + first_bias[i])
        output += last[j] * math.tanh(total)
    return output * scales[4] + scales[5]


@njit(void(float64[::1], float64, float64), cache=True)
def update_amplitude(memory: FloatArray, displacement: float, velocity: float) -> None:
    """Keep the displacement at the last reversal: memory = [amplitude, velocity of the step before]."""
    if velocity * memory[1] < 0.0:
        memory[0] = abs(displacement)
    if velocity != 0.0:
        memory[1] = velocity
    memory[0] = max(memory[0], abs(displacement))


@njit(float64(float64, float64[::1], float64, float64, float64), cache=True)
def desired_force(law: float, gains: FloatArray, displacement: float, velocity: float, amplitude: float) -> float:
    """Return the desired force of a collocated law: (4.14), or (4.18) with k = -alpha (4.20); clipped later."""
    if law == KELVIN:
        return gains[VISCOUS] * velocity + gains[STIFFNESS] * displacement
    if law == FRICTION:
        sign = 1.0 if velocity > 0.0 else (-1.0 if velocity < 0.0 else 0.0)
        return gains[ALPHA] * (sign * amplitude - displacement)
    return 0.0


def no_network() -> tuple[FloatArray, ...]:
    """Return placeholder arrays for a network that is not used."""
    return (np.zeros((1, 2)), np.zeros(1), np.zeros((1, 1)), np.zeros(1), np.zeros(1), np.ones(7))
