"""Parts of the compiled loop of several dampers: its arrays, forces of the dampers, sensors, central regulator."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import (
    COMMAND_FORCE,
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
    MEASURED_VELOCITY,
    OBSERVER_FORCE,
    S_REQUEST,
)
from mrpipe.dampers.plant import ACCELERATION, DISPLACEMENT, DRIVE, FORCE, VELOCITY, advance
from mrpipe.simulation.implicit_force import (
    ITERATIONS,
    narrowed,
    nearly_settled,
    next_guess,
    secant,
    settled,
    slope_between,
)
from mrpipe.simulation.parts import apply_faults, multiply

compiled_inside = njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""For functions that are called by compiled functions only: without entry points from Python they compile faster."""

TRACK_DAMPER, TRACK_LAW, TRACK_SAMPLED = 0, 1, 2
SWEEPS = 40
SETTLED, SETTLED_EXACTLY = 1e-6, 1e-10
"""Relative change of the forces between iterations at which a step ends: with dampers, and with linear laws or braces.
"""
EXACT_N, EXACT, EXACT_ITERATIONS = 1e-10, 1e-12, 8
"""Difference of answer and guess at which the search for the force of a damper behind a brace ends [N], the same as a
share of the answer, and the iterations after which the usual tolerance is sufficient.

The acceleration of the rod is a second difference of the force over the stiffness of the brace. It contains an error of
the force 9/(4 k_b dt^2) times, so that the usual tolerance makes it useless in short steps.
"""

# --- integers of the run ---
I_STEPS, I_PER_SAMPLE, I_DELAY, I_TRACK, I_RECORD, I_SIZE = 0, 1, 2, 3, 4, 5
# --- columns of `Devices.settings`, one row per damper ---
D_C, D_K, D_CLIPPED, D_FLEXIBILITY, D_LAG, D_COMMAND, D_SIZE = 0, 1, 2, 3, 4, 5, 6
# --- columns of the record after [z, absolute accelerations]: these of each damper, then those of the run ---
T_X, T_V, T_FORCE, T_DRIVE, T_DESIRED, T_WORK, T_DEVICE = 0, 1, 2, 3, 4, 5, 6
T_WORK_IN, T_WORK_FRAME, T_ENERGY, T_INPUTS = 0, 1, 2, 3
"""After the energy follow the inputs; the first of them is the ground acceleration."""
# --- columns of `Motion.known`, one row per damper ---
X, V, F, SLOPE, CURRENT, STATE_SIZE = 0, 1, 2, 3, 4, 5


class Structure(NamedTuple):
    """The structure with the places of its k dampers and its m inputs; n is the number of floors.

    Attributes
    ----------
    step_matrix
        Transposed, shape (2n + 2m + k, 2n): from [z, inputs before, inputs after, forces before] to the state after
        the step, without the forces at the end of the step.
    at_end
        What one newton of each damper at the end of the step adds to the state, shape (k, 2n).
    lower, gains
        Transposed lower half of A, shape (2n, n), and accelerations of one newton of each damper, shape (k, n).
    M, C, K
        Matrices of the structure.
    influence, pull, direct
        For each input, shape (m, n): displacement of each place per metre of the ground, minus the force of one unit,
        and acceleration by it that is not in the lower half of A.
    positions
        Displacement of each damper by that of each floor, shape (k, n).
    """

    step_matrix: FloatArray
    at_end: FloatArray
    lower: FloatArray
    gains: FloatArray
    M: FloatArray
    C: FloatArray
    K: FloatArray
    influence: FloatArray
    pull: FloatArray
    direct: FloatArray
    positions: FloatArray


class Devices(NamedTuple):
    """The dampers: rows of settings, chains with their parameters, and the states of the chains.

    Attributes
    ----------
    settings
        Shape (k, D_SIZE).
    chains, parameters, parameter_offsets, state_offsets
        Chain of each damper; the parameters of all chains one after another, and for each damper the places of its
        steps in its parameters and in its state.
    parameter_starts, state_starts
        Places of the dampers in the parameters and in the states of all, shape (k + 1,).
    states, trial
        States of the chains at the start of the step and at its end.
    wire
        Signals that the steps of a chain read and write.
    """

    settings: FloatArray
    chains: Any
    parameters: FloatArray
    parameter_offsets: IntArray
    state_offsets: IntArray
    parameter_starts: IntArray
    state_starts: IntArray
    states: FloatArray
    trial: FloatArray
    wire: FloatArray


class Controllers(NamedTuple):
    """The controllers: law, numbers, layout and memory of each, its readings and commands, and what acts at present.

    Attributes
    ----------
    laws, numbers, layouts, memories
        Law of each damper, and the arrays of all controllers one after another.
    places
        Places of the dampers in `numbers`, `layouts` and `memories`, shape (k + 1, 3).
    measured
        Last readings, shape (k, 5 + n).
    commands
        Filled, shape (k, samples, COMMAND_SIZE).
    wanted, asked
        Desired force [N] and drive of each damper that act at present, shape (k,).
    """

    laws: Any
    numbers: FloatArray
    layouts: IntArray
    memories: FloatArray
    places: IntArray
    measured: FloatArray
    commands: FloatArray
    wanted: FloatArray
    asked: FloatArray


class Central(NamedTuple):
    """The central regulator of some of the dampers.

    Attributes
    ----------
    regulator
        F, G, H, K of :class:`~mrpipe.control.central.CentralRegulator`, and for each sensor the number of the damper
        (of all dampers) and the channel, shape (p, 2).
    members
        Numbers of its dampers.
    estimate, readings
        Estimated state, and last good reading of each sensor.
    forces, wanted
        Forces of its dampers that the observer takes, and forces that it requests [N].
    """

    regulator: Any
    members: IntArray
    estimate: FloatArray
    readings: FloatArray
    forces: FloatArray
    wanted: FloatArray


class Motion(NamedTuple):
    """Motion, forces and work of the dampers.

    Attributes
    ----------
    known
        Displacement, velocity, force, slope and drive of each damper, shape (k, STATE_SIZE).
    forces, previous
        Forces now and at the step before [N], shape (k,).
    braces
        Deformation of each brace now and at the step before [m], and its rate at both [m/s], shape (k, 4).
    rod
        Acceleration of the rod of each damper by its brace [m/s^2], shape (k,).
    works
        Energy that each damper has dissipated [J], shape (k,).
    added
        What one newton at the end of the step adds to displacement, velocity and acceleration: of damper d by the
        force of damper e at [:, d, e], shape (3, k, k).
    free
        Displacement, velocity and acceleration at the end of the step without the forces there, shape (k, 3).
    answer
        Arguments of `chain_force` for each damper, shape (k, 9).
    """

    known: FloatArray
    forces: FloatArray
    previous: FloatArray
    braces: FloatArray
    rod: FloatArray
    works: FloatArray
    added: FloatArray
    free: FloatArray
    answer: FloatArray


@njit(cache=True)
def law_force(device: FloatArray, x_free: float, v_free: float, end_x: float, end_v: float) -> float:
    """Return c v + k x at the end of the step, clipped where it would be active; the motion is linear in the force."""
    c, k = device[D_C], device[D_K]
    force = (c * v_free + k * x_free) / (1.0 - c * end_v - k * end_x)
    return force if device[D_CLIPPED] == 0.0 or force * (v_free + end_v * force) >= 0.0 else 0.0


@compiled_inside
def chain_force(
    functions: Any, parameters: FloatArray, parameter_offsets: IntArray, state_offsets: IntArray, before: FloatArray,
    trial: FloatArray, wire: FloatArray, motion: FloatArray, device: FloatArray, dt: float,
) -> float:  # fmt: skip
    """Return the force of a damper at the end of a step, by a secant within a bracket; `trial` becomes its state.

    `motion` holds displacement, velocity and acceleration without the force, what one newton adds to each, the first
    guess of the force, the slope of the damper's answer that the step before ended with, and the flexibility of the
    brace.
    """
    guess, slope = motion[6], motion[7]
    found, last_guess, last_found = guess, 0.0, 0.0
    low, high = -math.inf, math.inf
    braced = motion[8] > 0.0
    for iteration in range(ITERATIONS):
        # written out, because a function with these arrays counts the references to them in each iteration
        for index in range(before.shape[0]):
            trial[index] = before[index]
        wire[DISPLACEMENT] = motion[0] + motion[3] * guess
        wire[VELOCITY] = motion[1] + motion[4] * guess
        wire[ACCELERATION] = motion[2] + motion[5] * guess
        wire[DRIVE] = device[CURRENT]
        advance(functions, parameters, parameter_offsets, state_offsets, trial, wire, dt)
        found = wire[FORCE]
        exactly = braced and iteration < EXACT_ITERATIONS
        if settled(found, guess) and (not exactly or abs(found - guess) <= EXACT_N + EXACT * abs(found)):
            motion[7] = slope
            return found
        if iteration > 0 and guess != last_guess:
            # before the last correction, because a brace makes the slope steep and different from step to step
            slope = slope_between(found, guess, last_found, last_guess)
        if nearly_settled(found, guess) and not exactly:
            motion[7] = slope
            return secant(found, guess, slope)
        low, high = narrowed(low, high, found, guess)
        last_guess, last_found = guess, found
        guess = next_guess(iteration, found, guess, slope, low, high)
        if guess == last_guess:
            break
    # a jump: the slope across it is not that of the next step
    return guess


@compiled_inside
def accelerations_of(
    structure: Structure, state: FloatArray, inputs: FloatArray, forces: FloatArray, accelerations: FloatArray,
    moved: FloatArray,
) -> None:  # fmt: skip
    """Fill the accelerations of the floors, and those of each place by the ground alone (`moved`).

    `forces` may be empty: the accelerations are then those without the dampers.
    """
    multiply(structure.lower, state, accelerations)
    for floor in range(moved.shape[0]):
        moved[floor] = 0.0
        for i in range(inputs.shape[0]):
            accelerations[floor] += structure.direct[i, floor] * inputs[i]
            moved[floor] += structure.influence[i, floor] * inputs[i]
    for d in range(forces.shape[0]):
        for floor in range(moved.shape[0]):
            accelerations[floor] += structure.gains[d, floor] * forces[d]


@njit(cache=True)
def read_sensors(
    accelerations: FloatArray, moved: FloatArray, w: FloatArray, device: FloatArray, ground: float, rod: float,
    noise: FloatArray, measured: FloatArray,
) -> None:  # fmt: skip
    """Fill the readings of one damper's sensors; `moved` is the acceleration of each place by the ground alone."""
    before = measured.copy()
    relative = rod
    for floor in range(w.shape[0]):
        measured[MEASURED_FLOORS + floor] = accelerations[floor] + noise[MEASURED_FLOORS + floor]
        relative += w[floor] * (accelerations[floor] - moved[floor])
    measured[MEASURED_GROUND] = ground + noise[MEASURED_GROUND]
    measured[MEASURED_DISPLACEMENT] = device[X] + noise[MEASURED_DISPLACEMENT]
    measured[MEASURED_VELOCITY] = device[V] + noise[MEASURED_VELOCITY]
    measured[MEASURED_FORCE] = device[F] + noise[MEASURED_FORCE]
    measured[MEASURED_ACCELERATION] = relative + noise[MEASURED_ACCELERATION]
    apply_faults(noise, before, measured)


@njit(cache=True)
def regulate(central: Central, measured: FloatArray) -> None:
    """Advance the observer of the central regulator and put the forces for the coming sample into `central.wanted`.

    A missing reading is replaced by the last good one.
    """
    F, G, H, K, sensors = central.regulator
    for row in range(sensors.shape[0]):
        reading = measured[int(sensors[row, 0]), int(sensors[row, 1])]
        if math.isfinite(reading):
            central.readings[row] = reading
    central.estimate[:] = F @ central.estimate + G @ central.forces + H @ central.readings
    central.wanted[:] = -(K @ central.estimate)


@compiled_inside
def request_forces(controllers: Controllers, central: Central, sample: int) -> None:
    """Let the central regulator request the forces of its dampers.

    Its observer takes the measured force of a damper or, where the controller says so, the last desired one.
    """
    for index in range(central.members.shape[0]):
        d = central.members[index]
        if controllers.layouts[controllers.places[d, 1] + OBSERVER_FORCE] == 0:
            central.forces[index] = controllers.commands[d, max(sample - 1, 0), COMMAND_FORCE]
        elif math.isfinite(controllers.measured[d, MEASURED_FORCE]):
            central.forces[index] = controllers.measured[d, MEASURED_FORCE]
    regulate(central, controllers.measured)
    for index in range(central.members.shape[0]):
        controllers.memories[controllers.places[central.members[index], 2] + S_REQUEST] = central.wanted[index]
