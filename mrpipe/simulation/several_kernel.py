"""The compiled loop of a structure with several dampers, each with a separate controller and possibly a brace.

The structure's linear part is exact for inputs that are linear between the ends of a step. The forces at the end of a
step are found together with the motion there: damper by damper, repeated until no force changes. A brace has no mass;
the rate of its deformation is the backward difference of second order, which damps motions that the step cannot
resolve.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numba import float64, int64, njit, types, void

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import (
    COMMAND_DRIVE,
    COMMAND_FORCE,
    LAW_FUNCTION,
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
    MEASURED_VELOCITY,
    S_REQUEST,
    controller_step,
)
from mrpipe.dampers.plant import (
    ACCELERATION,
    CHAIN_FUNCTIONS,
    DISPLACEMENT,
    DRIVE,
    FIRST,
    FORCE,
    TIME,
    VELOCITY,
    WIRE_SIZE,
    advance,
)
from mrpipe.simulation.parts import multiply, quadratic

TRACK_DAMPER, TRACK_LAW, TRACK_SAMPLED = 0, 1, 2
SWEEPS, ITERATIONS = 40, 60
TOLERANCE_N, CORRECTED_N = 1e-5, 2e-3
SETTLED, SETTLED_LAW = 1e-6, 1e-10
"""Relative change of the forces between iterations at which a step ends, with dampers and with linear laws."""

# --- integers of the run ---
I_STEPS, I_PER_SAMPLE, I_DELAY, I_TRACK, I_RECORD, I_SIZE = 0, 1, 2, 3, 4, 5
# --- columns of `devices`, one row per damper ---
D_C, D_K, D_CLIPPED, D_FLEXIBILITY, D_LAG, D_COMMAND, D_CENTRAL, D_SIZE = 0, 1, 2, 3, 4, 5, 6, 8
# --- columns of the record after [z, absolute accelerations]: these of each damper, then those of the run ---
T_X, T_V, T_FORCE, T_DRIVE, T_DESIRED, T_WORK, T_DEVICE = 0, 1, 2, 3, 4, 5, 6
T_WORK_IN, T_WORK_FRAME, T_ENERGY, T_INPUTS = 0, 1, 2, 3
"""After the energy follow the inputs; the first of them is the ground acceleration."""
# --- what is known of each damper from step to step ---
X, V, F, SLOPE, CURRENT, STATE_SIZE = 0, 1, 2, 3, 4, 5


@njit(cache=True)
def _law_force(device: FloatArray, x_free: float, v_free: float, end_x: float, end_v: float) -> float:
    """Return c v + k x at the end of the step, clipped where it would be active; the motion is linear in the force."""
    c, k = device[D_C], device[D_K]
    force = (c * v_free + k * x_free) / (1.0 - c * end_v - k * end_x)
    return force if device[D_CLIPPED] == 0.0 or force * (v_free + end_v * force) >= 0.0 else 0.0


@njit(cache=True)
def _chain_force(
    functions: Any, parameters: FloatArray, parameter_offsets: IntArray, state_offsets: IntArray, before: FloatArray,
    trial: FloatArray, wire: FloatArray, motion: FloatArray, device: FloatArray, dt: float,
) -> float:  # fmt: skip
    """Return the force of a damper at the end of a step, by a secant within a bracket; `trial` becomes its state.

    `motion` holds displacement, velocity and acceleration without the force, what one newton adds to each, the first
    guess of the force, and the slope of the damper's answer that the step before ended with.
    """
    guess, slope = motion[6], motion[7]
    found, last_guess, last_found = guess, 0.0, 0.0
    low, high = -math.inf, math.inf
    for iteration in range(ITERATIONS):
        for index in range(before.shape[0]):
            trial[index] = before[index]
        wire[DISPLACEMENT] = motion[0] + motion[3] * guess
        wire[VELOCITY] = motion[1] + motion[4] * guess
        wire[ACCELERATION] = motion[2] + motion[5] * guess
        wire[DRIVE] = device[CURRENT]
        advance(functions, parameters, parameter_offsets, state_offsets, trial, wire, dt)
        found = wire[FORCE]
        difference = found - guess
        if abs(difference) <= TOLERANCE_N + 1e-7 * abs(found):
            break
        if iteration > 0 and guess != last_guess:
            slope = min((found - last_found) / (guess - last_guess), 0.9)
        if abs(difference) <= CORRECTED_N + 1e-4 * abs(found):
            # so near that the slope leaves an error far below what matters
            guess += difference / (1.0 - slope)
            found = guess
            break
        last_guess, last_found = guess, found
        # the answer falls with the force that slows the motion, so that the solution is bracketed
        if difference > 0.0:
            low = max(low, guess)
        else:
            high = min(high, guess)
        following = guess + difference / (1.0 - slope)
        if low < high and not low < following < high:
            inside = low > -math.inf and high < math.inf
            following = 0.5 * (low + high) if inside else guess + difference
        if following == guess:
            break
        guess = following
    motion[7] = slope
    return found if abs(found - guess) <= 1e-3 * (1.0 + abs(found)) else guess


@njit(cache=True)
def _sense(
    accelerations: FloatArray, moved: FloatArray, w: FloatArray, device: FloatArray, ground: float, rod: float,
    noise: FloatArray, measured: FloatArray,
) -> None:  # fmt: skip
    """Fill the readings of one damper's sensors; `moved` is the acceleration of each place by the ground alone.

    In the noise, plus infinity marks a reading that repeats the last one, and minus infinity a reading of 0.
    """
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
    for channel in range(noise.shape[0]):
        if noise[channel] == math.inf:
            measured[channel] = before[channel]
        elif noise[channel] == -math.inf:
            measured[channel] = 0.0


@njit(cache=True)
def _add_inputs(
    direct: FloatArray, influence: FloatArray, inputs: FloatArray, accelerations: FloatArray, moved: FloatArray
) -> None:  # fmt: skip
    """Add the accelerations of the inputs that act as forces, and put those of the ground at each place in `moved`."""
    for floor in range(moved.shape[0]):
        moved[floor] = 0.0
        for i in range(inputs.shape[0]):
            accelerations[floor] += direct[i, floor] * inputs[i]
            moved[floor] += influence[i, floor] * inputs[i]


@njit(cache=True)
def _central(
    regulator: Any, estimate: FloatArray, measured: FloatArray, forces: FloatArray, wanted: FloatArray
) -> None:  # fmt: skip
    """Advance the observer of the central regulator and put the forces for the coming sample into `wanted`.

    `regulator` holds F, G, H, K and the sensors: the number of the damper (of all dampers) and the channel of each.
    """
    F, G, H, K, sensors = regulator
    following = F @ estimate + G @ forces
    for row in range(sensors.shape[0]):
        reading = measured[int(sensors[row, 0]), int(sensors[row, 1])]
        if math.isfinite(reading):
            for index in range(following.shape[0]):
                following[index] += H[index, row] * reading
    estimate[:] = following
    wanted[:] = -(K @ estimate)


def _run(
    counts: IntArray, dt: float, plant: Any, positions: FloatArray, devices: FloatArray, inputs: FloatArray,
    z: FloatArray, chains: Any, parameters: FloatArray, offsets: Any, damper_states: FloatArray, laws: Any,
    numbers: FloatArray, layouts: IntArray, places: IntArray, memories: FloatArray, regulator: Any, members: IntArray,
    noise: FloatArray, commands: FloatArray, record: FloatArray,
) -> None:  # fmt: skip
    """Run the loop; see :mod:`mrpipe.simulation.several` for the arrays.

    `plant` holds the transposed step matrix (2n + 2m + k, 2n), what one newton of each damper at the end of the step
    adds to the state (k, 2n), the transposed lower half of A, accelerations of one newton (k, n), M, C, K, and three
    rows for each of the m inputs, (3m, n): displacement of each place per metre of the ground, minus the force of one
    unit, and acceleration by it that is not in the lower half of A.
    """
    step_matrix, at_end, lower, gains, M, C, K, columns = plant
    k, n = positions.shape
    m = inputs.shape[1]
    size = 2 * n
    track, per_sample, every = counts[I_TRACK], counts[I_PER_SAMPLE], counts[I_RECORD]
    parameter_offsets, state_offsets, parameter_starts, state_starts = offsets
    settled = SETTLED_LAW if track == TRACK_LAW else SETTLED
    influence, pull, direct = columns[:m], columns[m : 2 * m], columns[2 * m :]
    before, free = np.zeros(size + 2 * m + k), np.zeros(size)
    moved, pushed, pushed_end = np.zeros(n), np.zeros(m), np.zeros(m)
    known, accelerations = np.zeros((k, STATE_SIZE)), np.zeros(n)
    braces = np.zeros((k, 3))  # deformation now and two steps back, with the rate in the last column
    measured = np.zeros((k, MEASURED_FLOORS + n))
    trial = np.zeros(damper_states.shape[0])
    motion = np.zeros((k, 8))
    free_motion = np.zeros((k, 3))
    cross_x, cross_v, cross_a = np.zeros((k, k)), np.zeros((k, k)), np.zeros((k, k))
    wire, wanted, asked = np.zeros(WIRE_SIZE), np.zeros(k), np.zeros(k)
    central, central_forces = np.zeros(members.shape[0]), np.zeros(members.shape[0])
    estimate = np.zeros(regulator[0].shape[0])
    forces, previous, works = np.zeros(k), np.zeros(k), np.zeros(k)
    rod = np.zeros(k)
    for e in range(k):
        multiply(lower, at_end[e], accelerations)
        for d in range(k):
            for floor in range(n):
                cross_x[d, e] += positions[d, floor] * at_end[e, floor]
                cross_v[d, e] += positions[d, floor] * at_end[e, n + floor]
                cross_a[d, e] += positions[d, floor] * (accelerations[floor] + gains[e, floor])
    before[:size] = z
    state = before[:size]
    loss, work_in, work_frame = quadratic(C, state[n:]), 0.0, 0.0
    for floor in range(n):
        for i in range(m):
            pushed[i] += pull[i, floor] * state[floor]
        for d in range(k):
            known[d, X] += positions[d, floor] * state[floor]
            known[d, V] += positions[d, floor] * state[n + floor]
    sample, active, written = -1, -1, 0
    for step in range(counts[I_STEPS] + 1):
        if step % per_sample == 0:
            sample += 1
            multiply(lower, state, accelerations)
            _add_inputs(direct, influence, inputs[step], accelerations, moved)
            for d in range(k):
                for floor in range(n):
                    accelerations[floor] += gains[d, floor] * forces[d]
            for d in range(k):
                _sense(
                    accelerations, moved, positions[d], known[d], inputs[step, 0], rod[d], noise[d, sample], measured[d]
                )  # fmt: skip
            if members.shape[0] > 0:
                for index in range(members.shape[0]):
                    central_forces[index] = commands[members[index], max(sample - 1, 0), COMMAND_FORCE]
                _central(regulator, estimate, measured, central_forces, central)
                for index in range(members.shape[0]):
                    memories[places[members[index], 2] + S_REQUEST] = central[index]
            for d in range(k):
                controller_step(
                    laws[d], numbers[places[d, 0] : places[d + 1, 0]], layouts[places[d, 1] : places[d + 1, 1]],
                    memories[places[d, 2] : places[d + 1, 2]], measured[d], commands[d, sample],
                )  # fmt: skip
        jumped = False
        if step >= counts[I_DELAY] and (step - counts[I_DELAY]) % per_sample == 0:
            active += 1
            jumped = True
            for d in range(k):
                wanted[d], asked[d] = commands[d, active, COMMAND_FORCE], commands[d, active, COMMAND_DRIVE]
        elif step == 0:
            for d in range(k):
                asked[d] = commands[d, 0, COMMAND_DRIVE]
        if step == 0:
            for d in range(k):
                known[d, CURRENT] = asked[d]
                if track == TRACK_DAMPER:
                    wire[FIRST], wire[TIME] = 1.0, 0.0
                    wire[DISPLACEMENT], wire[VELOCITY], wire[ACCELERATION] = known[d, X], known[d, V], 0.0
                    wire[DRIVE] = asked[d]
                    advance(
                        chains[d], parameters[parameter_starts[d] : parameter_starts[d + 1]], parameter_offsets[d],
                        state_offsets[d], damper_states[state_starts[d] : state_starts[d + 1]], wire, dt,
                    )  # fmt: skip
                    forces[d] = wire[FORCE]
                elif track == TRACK_LAW:
                    forces[d] = _law_force(devices[d], known[d, X], known[d, V], 0.0, 0.0)
                else:
                    forces[d] = wanted[d]
                previous[d], known[d, F] = forces[d], forces[d]
                braces[d, 0] = braces[d, 1] = devices[d, D_FLEXIBILITY] * forces[d]
            wire[FIRST] = 0.0
        elif jumped:
            # the controller holds its output: it changes now, and not along the step
            for d in range(k):
                if track == TRACK_SAMPLED:
                    forces[d] = wanted[d]
                elif track == TRACK_DAMPER and devices[d, D_LAG] == 1.0 and devices[d, D_COMMAND] >= 0.0:
                    damper_states[state_starts[d] + int(devices[d, D_COMMAND])] = asked[d]
        if step % every == 0:
            row = record[written]
            written += 1
            row[:size] = state
            multiply(lower, state, accelerations)
            _add_inputs(direct, influence, inputs[step], accelerations, moved)
            stored = 0.5 * (quadratic(M, state[n:]) + quadratic(K, state[:n]))
            for d in range(k):
                stored += 0.5 * devices[d, D_FLEXIBILITY] * forces[d] ** 2
                for floor in range(n):
                    accelerations[floor] += gains[d, floor] * forces[d]
                own = row[3 * n + d * T_DEVICE : 3 * n + (d + 1) * T_DEVICE]
                own[T_X], own[T_V], own[T_FORCE], own[T_DRIVE] = known[d, X], known[d, V], forces[d], known[d, CURRENT]
                own[T_DESIRED] = forces[d] if track == TRACK_LAW else wanted[d]
                own[T_WORK] = works[d]
            row[size : 3 * n] = accelerations
            tail = row[3 * n + k * T_DEVICE :]
            tail[T_WORK_IN], tail[T_WORK_FRAME], tail[T_ENERGY] = work_in, work_frame, stored
            tail[T_INPUTS:] = inputs[step]
        if step == counts[I_STEPS]:
            break
        # --- the structure without the forces at the end of the step
        for i in range(m):
            before[size + i], before[size + m + i] = inputs[step, i], inputs[step + 1, i]
        for d in range(k):
            before[size + 2 * m + d] = forces[d]
            known[d, CURRENT] += devices[d, D_LAG] * (asked[d] - known[d, CURRENT])
        multiply(step_matrix, before, free)
        multiply(lower, free, accelerations)
        _add_inputs(direct, influence, inputs[step + 1], accelerations, moved)
        for d in range(k):
            flexibility = devices[d, D_FLEXIBILITY]
            free_motion[d, 0], free_motion[d, 1], free_motion[d, 2] = 0.0, 0.0, 0.0
            for floor in range(n):
                free_motion[d, 0] += positions[d, floor] * free[floor]
                free_motion[d, 1] += positions[d, floor] * free[n + floor]
                free_motion[d, 2] += positions[d, floor] * (accelerations[floor] - moved[floor])
            # deformation of the brace at the end of the step: its rate is (3 b - 4 b1 + b2)/(2 dt)
            free_motion[d, 1] += (4.0 * braces[d, 0] - braces[d, 1]) / (2.0 * dt)
            motion[d, 3] = cross_x[d, d] - flexibility
            motion[d, 4] = cross_v[d, d] - 1.5 * flexibility / dt
            motion[d, 5] = cross_a[d, d]
            motion[d, 6] = 2.0 * forces[d] - previous[d] if track == TRACK_DAMPER else forces[d]
            motion[d, 7] = known[d, SLOPE]
        # --- forces at the end of the step, damper by damper
        wire[TIME] = (step + 1) * dt
        for _ in range(SWEEPS):
            change = 0.0
            for d in range(k):
                for part in range(3):
                    motion[d, part] = free_motion[d, part]
                for e in range(k):
                    if e != d:
                        motion[d, 0] += cross_x[d, e] * motion[e, 6]
                        motion[d, 1] += cross_v[d, e] * motion[e, 6]
                        motion[d, 2] += cross_a[d, e] * motion[e, 6]
                if track == TRACK_LAW:
                    found = _law_force(devices[d], motion[d, 0], motion[d, 1], motion[d, 3], motion[d, 4])
                elif track == TRACK_SAMPLED:
                    found = wanted[d]
                else:
                    found = _chain_force(
                        chains[d], parameters[parameter_starts[d] : parameter_starts[d + 1]], parameter_offsets[d],
                        state_offsets[d], damper_states[state_starts[d] : state_starts[d + 1]],
                        trial[state_starts[d] : state_starts[d + 1]], wire, motion[d], known[d], dt,
                    )  # fmt: skip
                    known[d, SLOPE] = motion[d, 7]
                change = max(change, abs(found - motion[d, 6]) / (1.0 + abs(found)))
                motion[d, 6] = found
            if k == 1 or change < settled:
                break
        damper_states[:] = trial
        for d in range(k):
            previous[d], forces[d] = forces[d], motion[d, 6]
            for index in range(size):
                free[index] += at_end[d, index] * forces[d]
        # --- energy and motion at the end of the step
        loss_end = quadratic(C, free[n:])
        for i in range(m):
            pushed_end[i] = 0.0
            for floor in range(n):
                pushed_end[i] += pull[i, floor] * free[floor]
            work_in -= 0.5 * (inputs[step, i] + inputs[step + 1, i]) * (pushed_end[i] - pushed[i])
            pushed[i] = pushed_end[i]
        work_frame += 0.5 * (loss + loss_end) * dt
        loss = loss_end
        for d in range(k):
            deformation = devices[d, D_FLEXIBILITY] * forces[d]
            rate = (3.0 * deformation - 4.0 * braces[d, 0] + braces[d, 1]) / (2.0 * dt)
            rod[d] = -(rate - braces[d, 2]) / dt
            braces[d, 1], braces[d, 0], braces[d, 2] = braces[d, 0], deformation, rate
            x, v = -deformation, -rate
            for floor in range(n):
                x += positions[d, floor] * free[floor]
                v += positions[d, floor] * free[n + floor]
            works[d] += 0.5 * (previous[d] + forces[d]) * (x - known[d, X])
            known[d, X], known[d, V], known[d, F] = x, v, forces[d]
        before[:size] = free
    z[:] = before[:size]


_V, _M, _I = float64[::1], float64[:, ::1], int64[::1]


@cache
def compiled(count: int) -> Any:
    """Return the loop compiled for `count` dampers."""
    signature = void(
        _I, float64, types.UniTuple(_M, 8), _M, _M, _M, _V, types.UniTuple(CHAIN_FUNCTIONS, count), _V,
        types.Tuple((int64[:, ::1], int64[:, ::1], _I, _I)), _V, types.UniTuple(LAW_FUNCTION, count), _V, _I,
        int64[:, ::1], _V, types.UniTuple(_M, 5), _I, float64[:, :, ::1], float64[:, :, ::1], _M,
    )  # fmt: skip
    return njit(signature, cache=True)(_run)
