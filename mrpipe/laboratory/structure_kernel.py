"""Structure of the virtual rig in exact time steps, with damper, controller and nonlinear storeys."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, types

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import (
    COMMAND_DRIVE,
    COMMAND_FORCE,
    COMMAND_SIZE,
    LAW_FUNCTION,
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
    MEASURED_VELOCITY,
    controller_step,
)
from mrpipe.laboratory.kernel import EFFECT_STATE, RING, STATE_SIZE, damper_step

JOINT_FRICTION_DAHL, JOINT_FRICTION_SMOOTH = 1, 2
CUBIC_ODD, CUBIC_ROOT = 3, 4
IMPACT_HERTZ, IMPACT_RUBBER = 5, 6
ROCKING_UPLIFT = 7
FORCE, DRIVE, DESIRED = 0, 1, 2
_SENSED = 4


@njit(cache=True)
def _storey_forces(
    codes: IntArray,
    values: FloatArray,
    sliding: FloatArray,
    drift_rows: FloatArray,
    floors: int,
    q: FloatArray,
    v: FloatArray,
    h: float,
    load: FloatArray,
) -> None:
    """Add the nonlinear forces of the structure to `load`, shape (degrees of freedom,)."""
    size = q.shape[0]
    for k in range(codes.shape[0]):
        code, numbers = codes[k], values[k]
        if code in (IMPACT_HERTZ, IMPACT_RUBBER):
            place = min(max(int(numbers[2]), 1), floors) - 1
            past = abs(q[place]) - numbers[1]
            if past > 0.0:
                side = 1.0 if q[place] > 0.0 else -1.0
                power = 1.5 if code == IMPACT_HERTZ else 1.0
                load[place] -= side * max(numbers[0] * past**power * (1.0 + numbers[3] * side * v[place]), 0.0)
            continue
        if code == ROCKING_UPLIFT:
            turn = q[size - 1]
            load[size - 1] += numbers[0] * (turn - numbers[1] * math.tanh(turn / numbers[1]))
            continue
        for storey in range(floors):
            drift, rate = 0.0, 0.0
            for j in range(size):
                drift += drift_rows[storey, j] * q[j]
                rate += drift_rows[storey, j] * v[j]
            force = 0.0
            if code == JOINT_FRICTION_DAHL:
                stuck = sliding[k, storey]
                # exact for constant speed in the step, because the spring of the joint yields towards its limit
                way = rate * h / numbers[1]
                side = 1.0 if way > 0.0 else -1.0
                stuck = side + (stuck - side) * math.exp(-abs(way))
                sliding[k, storey] = stuck
                force = numbers[0] * stuck
            elif code == JOINT_FRICTION_SMOOTH:
                force = numbers[0] * math.tanh(rate / numbers[1]) * (1.0 + 0.3 / (1.0 + (rate / numbers[2]) ** 2))
            elif code == CUBIC_ODD:
                force = numbers[0] * drift * abs(drift) ** (numbers[1] - 1.0)
            elif code == CUBIC_ROOT:
                force = numbers[0] * drift * (math.sqrt(1.0 + (drift / numbers[1]) ** 2) - 1.0)
            for j in range(size):
                load[j] -= drift_rows[storey, j] * force


@njit(cache=True)
def _advance(
    Ad: FloatArray, B0: FloatArray, B1: FloatArray, z: FloatArray, u0: FloatArray, u1: FloatArray, out: FloatArray
) -> None:
    rows, columns = z.shape[0], u0.shape[0]
    for i in range(rows):
        total = 0.0
        for j in range(rows):
            total += Ad[i, j] * z[j]
        for j in range(columns):
            total += B0[i, j] * u0[j] + B1[i, j] * u1[j]
        out[i] = total


@njit(cache=True)
def _motion(
    A: FloatArray, B: FloatArray, w: FloatArray, z: FloatArray, u: FloatArray, absolute: FloatArray
) -> tuple[float, float]:
    """Fill the absolute accelerations of the floors, and return speed and acceleration of the damper."""
    size, floors = w.shape[0], absolute.shape[0]
    speed, rod_acceleration = 0.0, 0.0
    for i in range(size):
        speed += w[i] * z[size + i]
        total = 0.0
        for j in range(2 * size):
            total += A[size + i, j] * z[j]
        for j in range(size + 1):
            total += B[size + i, j] * u[j]
        rod_acceleration += w[i] * total
        if i < floors:
            absolute[i] = total + u[0]
    return speed, rod_acceleration


@njit(cache=True)
def _read_sensors(
    measured: FloatArray, noise: FloatArray, drift: float, speed: float, force: float, ground: float,
    absolute: FloatArray,
) -> None:  # fmt: skip
    """Fill the readings of the controller's sensors."""
    measured[MEASURED_VELOCITY] = speed
    measured[MEASURED_DISPLACEMENT] = drift + noise[0]
    measured[MEASURED_ACCELERATION] = absolute[0] - ground + noise[1]
    measured[MEASURED_GROUND] = ground + noise[3]
    measured[MEASURED_FORCE] = force
    for i in range(absolute.shape[0]):
        measured[MEASURED_FLOORS + i] = absolute[i] + noise[_SENSED + i]


_ROWS = float64[:, ::1]
_ROW = float64[::1]


# the explicit signature passes a law as a pointer, so the function is not compiled again for each law
@njit(
    types.Tuple((_ROWS, _ROWS, _ROWS))(
        _ROWS, _ROWS, _ROWS, _ROWS, _ROWS, _ROW, _ROWS, int64, _ROW, float64, int64, int64[::1], _ROWS, boolean,
        _ROW, int64[::1], _ROWS, int64, int64, LAW_FUNCTION, _ROW, int64[::1], _ROW, _ROWS,
    ),
    cache=True,
)  # fmt: skip
def run_structure(  # noqa: PLR0915 - as the compiled loop of the simulation
    A: FloatArray,
    B: FloatArray,
    Ad: FloatArray,
    B0: FloatArray,
    B1: FloatArray,
    w: FloatArray,
    drift_rows: FloatArray,
    floors: int,
    ground: FloatArray,
    h: float,
    every: int,
    storey_codes: IntArray,
    storey_values: FloatArray,
    damped: bool,
    base: FloatArray,
    codes: IntArray,
    values: FloatArray,
    control_every: int,
    delay_steps: int,
    law: Any,
    numbers: FloatArray,
    layout: IntArray,
    memory_of_controller: FloatArray,
    sensor_noise: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shake the structure.

    Parameters
    ----------
    A, B, Ad, B0, B1
        State space z = [q, q'] with u = [ground acceleration, load on each degree of freedom], and its exact step for
        inputs linear within the step `h` [s].
    w, drift_rows
        Connectivity vector of the damper, shape (d,), and rows of the storey drifts, shape (floors, d).
    floors
        Number of floors.
    ground
        Ground acceleration on the fine clock, shape (m,) [m/s2].
    h
        Time step [s].
    every
        Number of fine steps per recorded sample.
    storey_codes, storey_values
        Codes and numbers of the nonlinear forces of the structure.
    damped, base, codes, values
        Whether the structure has a damper, and the damper (see :mod:`mrpipe.laboratory.kernel`).
    control_every, delay_steps
        Number of fine steps per controller sample (0: no controller, the drive is 0), and delay of its command in fine
        steps.
    law, numbers, layout, memory_of_controller
        Force, arrays and state of :class:`~mrpipe.control.controller.Controller`.
    sensor_noise
        Noise of the sensors of the controller, shape (ticks, 4 + floors), in the order of its measurements.

    Returns
    -------
    Displacements (samples, d) [m], absolute accelerations of the floors (samples, floors) [m/s2], and damper force [N],
    drive [A], desired force [N] (samples, 3).
    """
    steps, size = ground.shape[0], w.shape[0]
    samples = (steps + every - 1) // every
    displacement = np.zeros((samples, size))
    acceleration = np.zeros((samples, floors))
    loop = np.zeros((samples, 3))
    z, trial = np.zeros(2 * size), np.zeros(2 * size)
    u0, u1 = np.zeros(size + 1), np.zeros(size + 1)
    load = np.zeros(size)
    kinds = max(codes.shape[0], 1)
    state, state_kept = np.zeros(STATE_SIZE), np.zeros(STATE_SIZE)
    memory, memory_kept = np.zeros((kinds, EFFECT_STATE)), np.zeros((kinds, EFFECT_STATE))
    ring = np.zeros((kinds, RING))
    sliding = np.zeros((max(storey_codes.shape[0], 1), floors))
    sliding_kept = sliding.copy()
    waiting = np.zeros(delay_steps + 1)
    measured, command = np.zeros(MEASURED_FLOORS + floors), np.zeros(COMMAND_SIZE)
    drive, force, speed, rod_acceleration = 0.0, 0.0, 0.0, 0.0
    absolute = np.zeros(floors)
    for k in range(steps):
        if k > 0:
            u1[0] = ground[k]
            # predicted with the loads of the step before, then corrected once
            u1[1:] = u0[1:]
            _advance(Ad, B0, B1, z, u0, u1, trial)
            state_kept[:], memory_kept[:], sliding_kept[:] = state, memory, sliding
            for turn in range(2):
                load[:] = 0.0
                _storey_forces(
                    storey_codes, storey_values, sliding, drift_rows, floors, trial[:size], trial[size:], h, load
                )
                if damped:
                    x1, v1 = 0.0, 0.0
                    for j in range(size):
                        x1 += w[j] * trial[j]
                        v1 += w[j] * trial[size + j]
                    force = damper_step(
                        base, codes, values, state, memory, ring, x1, speed, v1, rod_acceleration, drive, k * h, h
                    )
                    for j in range(size):
                        load[j] -= w[j] * force
                u1[1:] = load
                if turn == 0:
                    _advance(Ad, B0, B1, z, u0, u1, trial)
                    state[:], memory[:], sliding[:] = state_kept, memory_kept, sliding_kept
            z[:] = trial
            u0[:] = u1
        else:
            u0[0] = ground[0]
        speed, rod_acceleration = _motion(A, B, w, z, u0, absolute)
        if control_every > 0 and k % control_every == 0:
            _read_sensors(measured, sensor_noise[k // control_every], z[0], speed, force, u0[0], absolute)
            controller_step(law, numbers, layout, memory_of_controller, measured, command)
        waiting[k % (delay_steps + 1)] = command[COMMAND_DRIVE]
        drive = waiting[(k + 1) % (delay_steps + 1)]
        if k % every == 0:
            row = k // every
            displacement[row] = z[:size]
            acceleration[row] = absolute
            loop[row, FORCE], loop[row, DRIVE], loop[row, DESIRED] = force, drive, command[COMMAND_FORCE]
    return displacement, acceleration, loop
