"""The controller of Figure 5.3 as one compiled function, called once per controller sample.

A controller consists of its law (a compiled function), the arrays `numbers` (float) and `layout` (integers), and an
array for its memory. The same function runs in every plant integrator and translates to C line by line
(:mod:`mrpipe.exports.controller`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import float64, int64, njit, types, void

from mrpipe.artifacts import FloatArray, IntArray

# --- measured: the readings of the sensors at this instant ---
MEASURED_DISPLACEMENT = 0  # of the damper [m]
MEASURED_ACCELERATION = 1  # of the damper: floor minus ground, both as absolute accelerations [m/s^2]
MEASURED_VELOCITY = 2  # m/s; read only where the controller was built with velocity="measured"
MEASURED_GROUND = 3  # ground acceleration [m/s^2]; read only by laws that need the accelerometers
MEASURED_FORCE = 4  # damper force, positive where it resists [N]; read only by laws that need it
MEASURED_FLOORS = 5  # from here: absolute acceleration of each floor [m/s^2]; as the ground acceleration

# --- command: the outputs of the controller ---
COMMAND_DRIVE = 0  # coil current [A] (or voltage [V]) to be held until the next sample
COMMAND_FORCE = 1  # desired force after clipping (P2 (22)) [N]
COMMAND_UNCLIPPED = 2  # desired force of the law [N]
COMMAND_DISPLACEMENT = 3  # estimated damper displacement [m]
COMMAND_VELOCITY = 4  # estimated damper velocity [m/s]
COMMAND_AMPLITUDE = 5  # X of (4.18) [m]
COMMAND_CLIPPED = 6  # 1 where clipping set the force to zero
COMMAND_SWITCHED = 7  # 1 where the switch P2 (24) set the drive to zero
COMMAND_INVERSE = 8  # drive of the inverse before switch, low-pass and limits [A]
COMMAND_FAULT = 9  # 0; 1 while a refused reading is replaced by the last good one; 2 at the safe drive
COMMAND_SIZE = 12

# --- layout ---
OUTPUT = 0  # whether the output of the law is a force or the drive
INVERSE = 1
VELOCITY_SOURCE = 2
FLOORS = 3
NETWORK_INVERSE = 4  # where in `layout` the inverse network is described
NETWORK_LAW = 5  # where in `layout` the network of the law is described
TABLE_SPEEDS = 6  # points of the inverse table in speed
TABLE_DRIVES = 7  # points of the inverse table in drive
AT_TABLE = 8  # where in `numbers` the table is
AT_OBSERVER = 9  # where in `numbers` the observer is
STATE_HISTORY = 10  # where in `state` the histories are: displacement, velocity, acceleration, force
HISTORY = 11  # length of each
STATE_OBSERVER = 12  # where in `state` the observer is
STATE_SIZE = 13
AT_LAW = 14  # where in `numbers` further numbers of the law are
STATE_LAW = 15  # where in `state` the memory of the law is
AT_LIMITS = 16  # where in `numbers` the largest plausible readings are; 0: not read
STATE_GOOD = 17  # where in `state` the last good readings are
CHANNELS = 18  # number of measurements
HOLD = 19  # number of samples for which the last good reading replaces a refused one
OBSERVER_FORCE = 20  # 1 where the observer takes the measured force of the damper, 0: the desired one
LAYOUT_SIZE = 24
# a network in `layout`: layers, then neurons of each (input included), channels, past values, absolute, channel codes
NET_AT = 0  # where in `numbers`
NET_LAYERS = 1
NET_PAST = 2
NET_CHANNELS = 3
NET_ABSOLUTE = 4
NET_CODES = 5  # four codes
NET_NEURONS = 9  # neurons of each layer, input first
NET_SIZE = 16

OUTPUT_FORCE, OUTPUT_DRIVE = 0, 1
INVERSE_NONE, INVERSE_TABLE, INVERSE_NETWORK = 0, 1, 2
VELOCITY_KALMAN, VELOCITY_MEASURED, VELOCITY_DIFFERENCE = 0, 1, 2

# --- numbers ---
SAMPLE_TIME = 0
GAIN_C = 1
GAIN_K = 2
GAIN_ALPHA = 3
RESIDUAL_FORCE = 4
DRIVE_LIMIT = 5  # largest drive; 1e300 if there is no limit
KALMAN = 7  # three gains: displacement, velocity, bias
DEAD_BAND = 10
EXTREMUM_STEP = 11
EXTREMUM_SHARE = 12
LOW_PASS = 13  # b0, b1, b2, a1, a2
INVERSE_SPACING = 18  # samples between past values of the inverse network
LAW_SPACING = 19  # samples between past values of the network of the law
TABLE_SPEED = 20  # largest speed of the inverse table [m/s]
TABLE_DRIVE = 21  # largest drive of the inverse table
ROUNDING = 22  # speed over which the friction of fdns changes its sign [m/s]; 0: a jump
MEMORY = 23  # time for which an extremum is valid [s]
SAFE_DRIVE = 24  # drive while the readings cannot be used
LARGEST_FORCE = 25  # largest force of the damper [N]; 1e300 if it is not known
HEAD = 32
# a network in `numbers`: input scale, input shift, output scale, output shift, then for each layer the weights by row
# and the biases

# --- state ---
S_STARTED = 0
S_X = 1
S_V = 2
S_BIAS = 3
S_ACCELERATION = 4
S_DIRECTION = 5  # of motion, with dead band
S_SEEKING = 6  # +1 a maximum, -1 a minimum
S_EXTREME = 7
S_AMPLITUDE = 8
S_FILTER = 9  # two
S_FORCE = 11  # last desired force
S_DISPLACEMENT = 12  # last measured displacement
S_AGE = 13  # time since the last extremum
S_REQUEST = 14  # drive that a law commands directly
S_FAULTS = 15  # samples in a row with a refused reading
S_READY = 16  # 1 after the first sample whose readings were all good
S_HEAD = 24

WIDEST = 256  # largest number of neurons of a layer, summed over networks that are evaluated together

LAW_SIGNATURE = float64(float64[::1], int64[::1], float64[::1], float64[::1])
"""Signature of the compiled force of a law: numbers, layout, state, measured -> desired force before clipping [N]."""

LAW_FUNCTION = types.FunctionType(LAW_SIGNATURE)
"""Compiled type of such a function, for the signatures of kernels that call it."""


@njit(int64(float64[::1], int64[::1], float64[::1], float64[::1]), cache=True)
def _guard(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> int:
    """Store the plausible readings; return 0 if all are plausible, 1 while some are held, 2 for the safe drive.

    A reading is refused if it is not finite or larger than its limit. After the safe drive the controller is reset,
    because its state dates from before the gap.
    """
    at, limits, refused = layout[STATE_GOOD], layout[AT_LIMITS], False
    for channel in range(layout[CHANNELS]):
        if numbers[limits + channel] <= 0.0:
            continue
        # the comparison is false for a reading that is not a number
        if abs(measured[channel]) <= numbers[limits + channel]:
            state[at + channel] = measured[channel]
        else:
            refused = True
    if not refused:
        if state[S_FAULTS] > layout[HOLD]:
            for index in range(at):
                state[index] = 0.0
        state[S_FAULTS] = 0.0
        state[S_READY] = 1.0
        return 0
    state[S_FAULTS] = min(state[S_FAULTS] + 1.0, 1e9)
    if state[S_READY] < 0.5 or state[S_FAULTS] > layout[HOLD]:
        return 2
    return 1


@njit(void(float64[::1], float64[::1], float64[::1], int64), cache=True)
def _estimate(numbers: FloatArray, state: FloatArray, measured: FloatArray, source: int) -> None:
    """Estimate the velocity: kinematic Kalman filter (5.1) to (5.3) with bias, backward difference, or sensor."""
    x, a, dt = measured[MEASURED_DISPLACEMENT], measured[MEASURED_ACCELERATION], numbers[SAMPLE_TIME]
    if state[S_STARTED] < 0.5:
        state[S_X], state[S_V], state[S_BIAS], state[S_ACCELERATION] = x, 0.0, 0.0, a
        if source == VELOCITY_MEASURED:
            state[S_V] = measured[MEASURED_VELOCITY]
        state[S_DISPLACEMENT] = x
        return
    if source == VELOCITY_MEASURED:
        state[S_X], state[S_V] = x, measured[MEASURED_VELOCITY]
    elif source == VELOCITY_DIFFERENCE:
        state[S_X], state[S_V] = x, (x - state[S_DISPLACEMENT]) / dt
    else:
        mean = 0.5 * (a + state[S_ACCELERATION]) - state[S_BIAS]
        predicted = state[S_X] + dt * state[S_V] + 0.5 * dt * dt * mean
        innovation = x - predicted
        state[S_X] = predicted + numbers[KALMAN] * innovation
        state[S_V] = state[S_V] + dt * mean + numbers[KALMAN + 1] * innovation
        state[S_BIAS] = state[S_BIAS] + numbers[KALMAN + 2] * innovation
    state[S_ACCELERATION] = a
    state[S_DISPLACEMENT] = x


@njit(void(float64[::1], float64[::1]), cache=True)
def _follow_motion(numbers: FloatArray, state: FloatArray) -> None:
    """Update the direction of motion, with a dead band, and the most recent extremum of displacement.

    An extremum counts once the displacement has come back from it by a step well above the noise.
    """
    x, v = state[S_X], state[S_V]
    if abs(v) > numbers[DEAD_BAND]:
        state[S_DIRECTION] = 1.0 if v > 0.0 else -1.0
    if state[S_STARTED] < 0.5:
        state[S_SEEKING] = 1.0 if v >= 0.0 else -1.0
        state[S_EXTREME] = x
        state[S_AMPLITUDE] = abs(x)
        return
    state[S_AGE] += numbers[SAMPLE_TIME]
    seeking = state[S_SEEKING]
    if seeking * x > seeking * state[S_EXTREME]:
        state[S_EXTREME] = x
    step = max(numbers[EXTREMUM_STEP], numbers[EXTREMUM_SHARE] * state[S_AMPLITUDE])
    if seeking * (state[S_EXTREME] - x) > step:
        state[S_AMPLITUDE] = abs(state[S_EXTREME])
        state[S_SEEKING] = -seeking
        state[S_EXTREME] = x
        state[S_AGE] = 0.0
    elif state[S_AGE] > numbers[MEMORY]:
        # a damper that sticks has no extremum: without this rule the last extremum would keep the damper locked
        state[S_AMPLITUDE] = abs(state[S_EXTREME])
        state[S_SEEKING] = 1.0 if v >= 0.0 else -1.0
        state[S_EXTREME] = x
        state[S_AGE] = 0.0


@njit(void(int64[::1], float64[::1], float64, float64, float64, float64), cache=True)
def _remember(layout: IntArray, state: FloatArray, x: float, v: float, a: float, force: float) -> None:
    """Prepend the present values to the histories (newest first); the first call fills the histories."""
    length = layout[HISTORY]
    for channel in range(4):
        at = layout[STATE_HISTORY] + channel * length
        value = x if channel == 0 else v if channel == 1 else a if channel == 2 else force
        if state[S_STARTED] < 0.5:
            for index in range(length):
                state[at + index] = value
        for index in range(length - 1, 0, -1):
            state[at + index] = state[at + index - 1]
        state[at] = value


@njit(float64(float64[::1], int64[::1], float64[::1], int64, float64), cache=True)
def evaluate(numbers: FloatArray, layout: IntArray, state: FloatArray, where: int, spacing: float) -> float:
    """Return the output of a network on the histories; past values lie `spacing` samples apart."""
    signal = np.empty(WIDEST)
    result = np.empty(WIDEST)
    past = layout[where + NET_PAST]
    width = layout[where + NET_NEURONS]
    at = layout[where + NET_AT]
    row = 0
    for channel in range(layout[where + NET_CHANNELS]):
        base = layout[STATE_HISTORY] + layout[where + NET_CODES + channel] * layout[HISTORY]
        for lag in range(past + 1):
            place = lag * spacing
            left = int(place)
            share = place - left
            value = state[base + left]
            if share > 1e-9:
                value = (1.0 - share) * value + share * state[base + left + 1]
            if layout[where + NET_ABSOLUTE] == 1:
                value = abs(value)
            signal[row] = (value - numbers[at + width + row]) / numbers[at + row]
            row += 1
    at += 2 * width
    output_scale, output_shift = numbers[at], numbers[at + 1]
    at += 2
    layers = layout[where + NET_LAYERS]
    for layer in range(layers):
        inner, outer = layout[where + NET_NEURONS + layer], layout[where + NET_NEURONS + layer + 1]
        for neuron in range(outer):
            total = numbers[at + outer * inner + neuron]
            for index in range(inner):
                total += numbers[at + neuron * inner + index] * signal[index]
            result[neuron] = math.tanh(total) if layer < layers - 1 else total
        for neuron in range(outer):
            signal[neuron] = result[neuron]
        at += outer * (inner + 1)
    return signal[0] * output_scale + output_shift


@njit(float64(float64[::1], int64[::1], float64, float64), cache=True)
def _look_up(numbers: FloatArray, layout: IntArray, speed: float, force: float) -> float:
    """Return the drive at which the post-yield force at `speed` is `force`: inverse table, linear between."""
    drives = layout[TABLE_DRIVES]
    last = layout[TABLE_SPEEDS] - 1
    place = min(speed / numbers[TABLE_SPEED], 1.0) * last
    row = min(int(place), last - 1)
    share = place - row
    at = layout[AT_TABLE] + row * drives
    before = 0.0
    for index in range(drives):
        value = (1.0 - share) * numbers[at + index] + share * numbers[at + drives + index]
        if value >= force:
            if index == 0:
                return 0.0
            step = numbers[TABLE_DRIVE] / (drives - 1)
            return step * (index - 1 + (force - before) / max(value - before, 1e-12))
        before = value
    return numbers[TABLE_DRIVE]


@njit(float64(float64[::1], int64[::1], float64[::1], float64), cache=True)
def _drive(numbers: FloatArray, layout: IntArray, state: FloatArray, force: float) -> float:
    """Return the drive of the inverse, before switch, low-pass and limits."""
    if layout[OUTPUT] == OUTPUT_DRIVE:
        return state[S_REQUEST]
    if layout[INVERSE] == INVERSE_TABLE:
        return _look_up(numbers, layout, abs(state[S_V]), abs(force))
    if layout[INVERSE] == INVERSE_NETWORK:
        return evaluate(numbers, layout, state, layout[NETWORK_INVERSE], numbers[INVERSE_SPACING])
    return 0.0


@njit(void(LAW_FUNCTION, float64[::1], int64[::1], float64[::1], float64[::1], float64[::1]), cache=True)
def controller_step(
    law: Any, numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray, command: FloatArray
) -> None:
    """Run the controller for one of its samples.

    Call it every `controller.sample_time_s` seconds of plant time with the sensors' readings and hold
    `command[COMMAND_DRIVE]` until the next call (later by the controller's delay where there is one)::

        controller = build_controller(...)
        state = controller.new_state()
        measured = np.zeros(controller.measured_size)
        command = np.zeros(COMMAND_SIZE)
        ...
        controller_step(*controller.arguments, state, measured, command)

    Parameters
    ----------
    law, numbers, layout
        Law and arrays of the :class:`~mrpipe.control.controller.Controller`.
    state
        Its memory: zeros before the first call (:meth:`Controller.new_state`).
    measured
        Shape (5 + floors,), filled by the caller; indices MEASURED_...: damper displacement [m], damper acceleration
        (absolute floor acceleration minus ground acceleration) [m/s^2], damper velocity [m/s] (only for
        velocity="measured"), and for laws that need them: ground acceleration [m/s^2], damper force [N], absolute
        accelerations of the floors [m/s^2].
    command
        Shape (COMMAND_SIZE,), filled here; indices COMMAND_...

    A reading that is not finite or not plausible is replaced by the last good one for a few samples; after that the
    drive is the safe one until all readings are good again, and `command[COMMAND_FAULT]` reports it.

    Source: Figure 5.3; law, clipping P2 (22), inverse P2 (23), switch P2 (24), low-pass, limits.
    """
    fault = _guard(numbers, layout, state, measured)
    if fault == 2:
        command[:] = 0.0
        command[COMMAND_DRIVE] = numbers[SAFE_DRIVE]
        command[COMMAND_DISPLACEMENT] = state[S_X]
        command[COMMAND_VELOCITY] = state[S_V]
        command[COMMAND_AMPLITUDE] = state[S_AMPLITUDE]
        command[COMMAND_FAULT] = 2.0
        return
    readings = state[layout[STATE_GOOD] : layout[STATE_GOOD] + layout[CHANNELS]]
    _estimate(numbers, state, readings, layout[VELOCITY_SOURCE])
    _follow_motion(numbers, state)
    # a law with a network needs the histories of motion before the force of this instant is known
    _remember(layout, state, state[S_X], state[S_V], readings[MEASURED_ACCELERATION], 0.0)
    wanted = law(numbers, layout, state, readings)
    force = wanted
    direct = layout[OUTPUT] == OUTPUT_DRIVE
    clipped = not direct and wanted * state[S_DIRECTION] < 0.0
    if clipped:
        force = 0.0
    at = layout[STATE_HISTORY] + 3 * layout[HISTORY]
    state[at] = force
    if state[S_STARTED] < 0.5:
        for index in range(layout[HISTORY]):
            state[at + index] = force
    asked = _drive(numbers, layout, state, force)
    drive = asked
    switched = not direct and abs(force) < numbers[RESIDUAL_FORCE]
    if switched:
        drive = 0.0
    if state[S_STARTED] < 0.5 and direct:
        # a passive damper has its drive before the start, so that the low-pass starts in equilibrium
        state[S_FILTER] = drive * (1.0 - numbers[LOW_PASS])
        state[S_FILTER + 1] = drive * (numbers[LOW_PASS + 2] - numbers[LOW_PASS + 4])
    filtered = numbers[LOW_PASS] * drive + state[S_FILTER]
    state[S_FILTER] = numbers[LOW_PASS + 1] * drive - numbers[LOW_PASS + 3] * filtered + state[S_FILTER + 1]
    state[S_FILTER + 1] = numbers[LOW_PASS + 2] * drive - numbers[LOW_PASS + 4] * filtered
    state[S_FORCE] = force
    state[S_STARTED] = 1.0
    command[COMMAND_DRIVE] = min(max(filtered, 0.0), numbers[DRIVE_LIMIT])
    command[COMMAND_FORCE] = force
    command[COMMAND_UNCLIPPED] = wanted
    command[COMMAND_DISPLACEMENT] = state[S_X]
    command[COMMAND_VELOCITY] = state[S_V]
    command[COMMAND_AMPLITUDE] = state[S_AMPLITUDE]
    command[COMMAND_CLIPPED] = 1.0 if clipped else 0.0
    command[COMMAND_SWITCHED] = 1.0 if switched else 0.0
    command[COMMAND_INVERSE] = asked
    command[COMMAND_FAULT] = fault
