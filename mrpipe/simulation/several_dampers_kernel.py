"""The compiled loop of a structure with several dampers, each with a separate controller and possibly a brace.

The structure's linear part is exact for inputs that are linear between the ends of a step. The forces at the end of a
step are found together with the motion there: damper by damper, repeated until no force changes. A brace has no mass;
rate and acceleration of its deformation are backward differences of second order, which damp what no step resolves.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import float64, int64, njit, types, void

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import COMMAND_DRIVE, COMMAND_FORCE, LAW_FUNCTION, MEASURED_FLOORS, controller_step
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
from mrpipe.simulation.several_dampers_parts import (
    CURRENT,
    D_COMMAND,
    D_FLEXIBILITY,
    D_LAG,
    I_DELAY,
    I_PER_SAMPLE,
    I_RECORD,
    I_STEPS,
    I_TRACK,
    SETTLED,
    SETTLED_EXACTLY,
    SLOPE,
    STATE_SIZE,
    SWEEPS,
    T_DESIRED,
    T_DEVICE,
    T_DRIVE,
    T_ENERGY,
    T_FORCE,
    T_INPUTS,
    T_V,
    T_WORK,
    T_WORK_FRAME,
    T_WORK_IN,
    T_X,
    TRACK_DAMPER,
    TRACK_LAW,
    TRACK_SAMPLED,
    Central,
    Controllers,
    Devices,
    F,
    Motion,
    Structure,
    V,
    X,
    accelerations_of,
    chain_force,
    compiled_inside,
    law_force,
    read_sensors,
    request_forces,
)


@compiled_inside
def _motion_at_start(structure: Structure, state: FloatArray) -> Motion:
    """Return the motion of the dampers at the start, without forces, and what their forces add to it in a step."""
    k, n = structure.positions.shape
    known, added, accelerations = np.zeros((k, STATE_SIZE)), np.zeros((3, k, k)), np.zeros(n)
    for e in range(k):
        at_end = structure.at_end[e]
        multiply(structure.lower, at_end, accelerations)
        for d in range(k):
            for floor in range(n):
                position = structure.positions[d, floor]
                added[0, d, e] += position * at_end[floor]
                added[1, d, e] += position * at_end[n + floor]
                added[2, d, e] += position * (accelerations[floor] + structure.gains[e, floor])
    for d in range(k):
        for floor in range(n):
            known[d, X] += structure.positions[d, floor] * state[floor]
            known[d, V] += structure.positions[d, floor] * state[n + floor]
    return Motion(
        known, np.zeros(k), np.zeros(k), np.zeros((k, 4)), np.zeros(k), np.zeros(k), added, np.zeros((k, 3)),
        np.zeros((k, 9)),
    )  # fmt: skip


@compiled_inside
def _control(
    positions: FloatArray, motion: Motion, controllers: Controllers, central: Central, noise: FloatArray, sample: int,
    accelerations: FloatArray, moved: FloatArray, ground: float,
) -> None:  # fmt: skip
    """Read the sensors and compute the commands of one sample."""
    places = controllers.places
    for d in range(places.shape[0] - 1):
        read_sensors(
            accelerations, moved, positions[d], motion.known[d], ground, motion.rod[d], noise[d, sample],
            controllers.measured[d],
        )  # fmt: skip
    if central.members.shape[0] > 0:
        request_forces(controllers, central, sample)
    for d in range(places.shape[0] - 1):
        controller_step(
            controllers.laws[d], controllers.numbers[places[d, 0] : places[d + 1, 0]],
            controllers.layouts[places[d, 1] : places[d + 1, 1]],
            controllers.memories[places[d, 2] : places[d + 1, 2]], controllers.measured[d],
            controllers.commands[d, sample],
        )  # fmt: skip


@compiled_inside
def _start_forces(devices: Devices, motion: Motion, controllers: Controllers, track: int, dt: float) -> None:
    """Set the forces of the first step; all lags start in equilibrium with the first command."""
    wire, starts, states = devices.wire, devices.parameter_starts, devices.state_starts
    for d in range(motion.forces.shape[0]):
        known = motion.known[d]
        known[CURRENT] = controllers.asked[d]
        if track == TRACK_DAMPER:
            wire[FIRST], wire[TIME] = 1.0, 0.0
            wire[DISPLACEMENT], wire[VELOCITY], wire[ACCELERATION] = known[X], known[V], 0.0
            wire[DRIVE] = controllers.asked[d]
            advance(
                devices.chains[d], devices.parameters[starts[d] : starts[d + 1]], devices.parameter_offsets[d],
                devices.state_offsets[d], devices.states[states[d] : states[d + 1]], wire, dt,
            )  # fmt: skip
            force = wire[FORCE]
        elif track == TRACK_LAW:
            force = law_force(devices.settings[d], known[X], known[V], 0.0, 0.0)
        else:
            force = controllers.wanted[d]
        motion.forces[d], motion.previous[d], known[F] = force, force, force
        motion.braces[d, 0] = motion.braces[d, 1] = devices.settings[d, D_FLEXIBILITY] * force
    wire[FIRST] = 0.0


@compiled_inside
def _hold(devices: Devices, motion: Motion, controllers: Controllers, track: int) -> None:
    """Let new commands act: a controller holds its output, so that it changes now and not along the step."""
    for d in range(motion.forces.shape[0]):
        settings = devices.settings[d]
        if track == TRACK_SAMPLED:
            motion.forces[d] = controllers.wanted[d]
        elif track == TRACK_DAMPER and settings[D_LAG] == 1.0 and settings[D_COMMAND] >= 0.0:
            devices.states[devices.state_starts[d] + int(settings[D_COMMAND])] = controllers.asked[d]


@compiled_inside
def _record(
    structure: Structure, settings: FloatArray, motion: Motion, wanted: FloatArray, state: FloatArray,
    accelerations: FloatArray, inputs: FloatArray, work_in: float, work_frame: float, row: FloatArray,
) -> None:  # fmt: skip
    """Write the state, the accelerations, the signals of each damper and the energies into a row of the record."""
    k, n = structure.positions.shape
    row[: 2 * n], row[2 * n : 3 * n] = state, accelerations
    stored = 0.5 * (quadratic(structure.M, state[n:]) + quadratic(structure.K, state[:n]))
    for d in range(k):
        known, force = motion.known[d], motion.forces[d]
        stored += 0.5 * settings[d, D_FLEXIBILITY] * force**2
        own = row[3 * n + d * T_DEVICE : 3 * n + (d + 1) * T_DEVICE]
        own[T_X], own[T_V], own[T_FORCE], own[T_DRIVE] = known[X], known[V], force, known[CURRENT]
        own[T_DESIRED] = wanted[d]
        own[T_WORK] = motion.works[d]
    tail = row[3 * n + k * T_DEVICE :]
    tail[T_WORK_IN], tail[T_WORK_FRAME], tail[T_ENERGY] = work_in, work_frame, stored
    tail[T_INPUTS:] = inputs


@compiled_inside
def _move_freely(
    positions: FloatArray, settings: FloatArray, motion: Motion, track: int, free: FloatArray,
    accelerations: FloatArray, moved: FloatArray, dt: float,
) -> None:  # fmt: skip
    """Fill the motion of each damper at the end of the step without the forces there, and guess its force."""
    k, n = positions.shape
    for d in range(k):
        flexibility, answer, part = settings[d, D_FLEXIBILITY], motion.answer[d], motion.free[d]
        part[0], part[1], part[2] = 0.0, 0.0, 0.0
        for floor in range(n):
            part[0] += positions[d, floor] * free[floor]
            part[1] += positions[d, floor] * free[n + floor]
            part[2] += positions[d, floor] * (accelerations[floor] - moved[floor])
        # deformation of the brace at the end of the step: its rate is (3 b - 4 b1 + b2)/(2 dt)
        part[1] += (4.0 * motion.braces[d, 0] - motion.braces[d, 1]) / (2.0 * dt)
        answer[3] = motion.added[0, d, d] - flexibility
        answer[4] = motion.added[1, d, d] - 1.5 * flexibility / dt
        answer[5] = motion.added[2, d, d]
        answer[6] = 2.0 * motion.forces[d] - motion.previous[d] if track == TRACK_DAMPER else motion.forces[d]
        answer[7], answer[8] = motion.known[d, SLOPE], flexibility


@compiled_inside
def _find_forces(devices: Devices, motion: Motion, controllers: Controllers, track: int, dt: float) -> None:
    """Find the forces at the end of the step, damper by damper, until no force changes; they are in `answer[:, 6]`."""
    k = motion.forces.shape[0]
    answer, starts, states = motion.answer, devices.parameter_starts, devices.state_starts
    exactly = track == TRACK_LAW or np.any(answer[:, 8] > 0.0)
    settled = SETTLED_EXACTLY if exactly else SETTLED
    for _ in range(SWEEPS):
        change = 0.0
        for d in range(k):
            for part in range(3):
                answer[d, part] = motion.free[d, part]
            for e in range(k):
                if e != d:
                    for part in range(3):
                        answer[d, part] += motion.added[part, d, e] * answer[e, 6]
            if track == TRACK_LAW:
                found = law_force(devices.settings[d], answer[d, 0], answer[d, 1], answer[d, 3], answer[d, 4])
            elif track == TRACK_SAMPLED:
                found = controllers.wanted[d]
            else:
                found = chain_force(
                    devices.chains[d], devices.parameters[starts[d] : starts[d + 1]], devices.parameter_offsets[d],
                    devices.state_offsets[d], devices.states[states[d] : states[d + 1]],
                    devices.trial[states[d] : states[d + 1]], devices.wire, answer[d], motion.known[d], dt,
                )  # fmt: skip
                motion.known[d, SLOPE] = answer[d, 7]
            change = max(change, abs(found - answer[d, 6]) / (1.0 + abs(found)))
            answer[d, 6] = found
        if k == 1 or change < settled:
            break


@compiled_inside
def _finish_step(
    positions: FloatArray, at_end: FloatArray, settings: FloatArray, motion: Motion, free: FloatArray, dt: float
) -> None:
    """Add the forces at the end of the step to the state `free`, and update braces, work and motion of the dampers."""
    k, n = positions.shape
    for d in range(k):
        motion.previous[d], motion.forces[d] = motion.forces[d], motion.answer[d, 6]
        for index in range(2 * n):
            free[index] += at_end[d, index] * motion.forces[d]
    for d in range(k):
        known, braces = motion.known[d], motion.braces[d]
        deformation = settings[d, D_FLEXIBILITY] * motion.forces[d]
        rate = (3.0 * deformation - 4.0 * braces[0] + braces[1]) / (2.0 * dt)
        # of second order too: a simple difference is half a step late, and the Kalman filter reads this acceleration
        motion.rod[d] = -(3.0 * rate - 4.0 * braces[2] + braces[3]) / (2.0 * dt)
        braces[1], braces[0] = braces[0], deformation
        braces[3], braces[2] = braces[2], rate
        x, v = -deformation, -rate
        for floor in range(n):
            x += positions[d, floor] * free[floor]
            v += positions[d, floor] * free[n + floor]
        motion.works[d] += 0.5 * (motion.previous[d] + motion.forces[d]) * (x - known[X])
        known[X], known[V], known[F] = x, v, motion.forces[d]


@compiled_inside
def _momenta(pull: FloatArray, state: FloatArray, result: FloatArray) -> None:
    """Fill the sums, one for each input, whose change times the input is the work that the input takes out."""
    for i in range(result.shape[0]):
        result[i] = 0.0
        for floor in range(pull.shape[1]):
            result[i] += pull[i, floor] * state[floor]


@compiled_inside
def _assembled(
    plant: Any, positions: FloatArray, inputs: int, settings: FloatArray, chains: Any, parameters: FloatArray,
    offsets: Any, damper_states: FloatArray, control: Any, commands: FloatArray,
) -> tuple[Structure, Devices, Controllers, Central]:  # fmt: skip
    """Return structure, dampers, controllers and central regulator from the arrays of :func:`_run`."""
    step_matrix, at_end, lower, gains, M, C, K, columns = plant
    laws, numbers, layouts, places, memories, regulator, members = control
    k, n = positions.shape
    m = inputs
    structure = Structure(
        step_matrix, at_end, lower, gains, M, C, K, columns[:m], columns[m : 2 * m], columns[2 * m :], positions
    )
    parameter_offsets, state_offsets, parameter_starts, state_starts = offsets
    devices = Devices(
        settings, chains, parameters, parameter_offsets, state_offsets, parameter_starts, state_starts, damper_states,
        np.zeros(damper_states.shape[0]), np.zeros(WIRE_SIZE),
    )  # fmt: skip
    controllers = Controllers(
        laws, numbers, layouts, memories, places, np.zeros((k, MEASURED_FLOORS + n)), commands, np.zeros(k), np.zeros(k)
    )
    estimate, both = np.zeros(regulator[0].shape[0]), np.zeros((2, members.shape[0]))
    readings = np.zeros(regulator[4].shape[0])
    return structure, devices, controllers, Central(regulator, members, estimate, readings, both[0], both[1])


@compiled_inside
def _act(
    counts: IntArray, step: int, active: int, devices: Devices, motion: Motion, controllers: Controllers, dt: float
) -> int:
    """Let the commands of the coming sample act; at the first step set the forces. Return the sample that acts."""
    if step >= counts[I_DELAY]:
        active += 1
        controllers.wanted[:] = controllers.commands[:, active, COMMAND_FORCE]
    controllers.asked[:] = controllers.commands[:, max(active, 0), COMMAND_DRIVE]
    if step == 0:
        _start_forces(devices, motion, controllers, counts[I_TRACK], dt)
    else:
        _hold(devices, motion, controllers, counts[I_TRACK])
    return active


def _run(
    counts: IntArray, dt: float, plant: Any, positions: FloatArray, settings: FloatArray, inputs: FloatArray,
    z: FloatArray, chains: Any, parameters: FloatArray, offsets: Any, damper_states: FloatArray, laws: Any,
    numbers: FloatArray, layouts: IntArray, places: IntArray, memories: FloatArray, regulator: Any, members: IntArray,
    noise: FloatArray, commands: FloatArray, record: FloatArray,
) -> None:  # fmt: skip
    """Run the loop; the arrays are those of :mod:`mrpipe.simulation.several_dampers` and of `several_dampers_parts`.

    `plant` holds the first seven arrays of :class:`Structure`, and the rows of `influence`, `pull` and `direct` one
    after another, shape (3m, n). `z` is the initial state; it is overwritten by the final state.
    """
    k, n = positions.shape
    m = inputs.shape[1]
    size = 2 * n
    track, C = counts[I_TRACK], plant[5]
    control = (laws, numbers, layouts, places, memories, regulator, members)
    structure, devices, controllers, central = _assembled(
        plant, positions, m, settings, chains, parameters, offsets, damper_states, control, commands
    )
    before, free, no_forces = np.zeros(size + 2 * m + k), np.zeros(size), np.zeros(0)
    accelerations, moved, pushed, pushed_end = np.zeros(n), np.zeros(n), np.zeros(m), np.zeros(m)
    before[:size] = z
    state = before[:size]
    motion = _motion_at_start(structure, state)
    loss, work_in, work_frame = quadratic(C, state[n:]), 0.0, 0.0
    _momenta(structure.pull, state, pushed)
    sample, active, written = -1, -1, 0
    for step in range(counts[I_STEPS] + 1):
        if step % counts[I_PER_SAMPLE] == 0:
            sample += 1
            accelerations_of(structure, state, inputs[step], motion.forces, accelerations, moved)
            _control(positions, motion, controllers, central, noise, sample, accelerations, moved, inputs[step, 0])
        late = step - counts[I_DELAY]
        if step == 0 or (late >= 0 and late % counts[I_PER_SAMPLE] == 0):
            active = _act(counts, step, active, devices, motion, controllers, dt)
        if step % counts[I_RECORD] == 0:
            accelerations_of(structure, state, inputs[step], motion.forces, accelerations, moved)
            _record(
                structure, settings, motion, motion.forces if track == TRACK_LAW else controllers.wanted, state,
                accelerations, inputs[step], work_in, work_frame, record[written],
            )  # fmt: skip
            written += 1
        if step == counts[I_STEPS]:
            break
        before[size : size + m], before[size + m : size + 2 * m] = inputs[step], inputs[step + 1]
        before[size + 2 * m :] = motion.forces
        for d in range(k):
            motion.known[d, CURRENT] += settings[d, D_LAG] * (controllers.asked[d] - motion.known[d, CURRENT])
        multiply(structure.step_matrix, before, free)
        accelerations_of(structure, free, inputs[step + 1], no_forces, accelerations, moved)
        _move_freely(positions, settings, motion, track, free, accelerations, moved, dt)
        devices.wire[TIME] = (step + 1) * dt
        _find_forces(devices, motion, controllers, track, dt)
        devices.states[:] = devices.trial
        _finish_step(positions, structure.at_end, settings, motion, free, dt)
        loss_end = quadratic(C, free[n:])
        _momenta(structure.pull, free, pushed_end)
        for i in range(m):
            work_in -= 0.5 * (inputs[step, i] + inputs[step + 1, i]) * (pushed_end[i] - pushed[i])
        work_frame += 0.5 * (loss + loss_end) * dt
        loss = loss_end
        pushed[:] = pushed_end
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
