"""The compiled loop of Figure 5.3: frame, damper, sensors and controller.

One plant step: the linear part of the frame is exact for inputs that are linear between the ends of the step
(`discretise_first_order`). The force at the end of the step is solved for together with the motion there, by
fixed-point iteration and, if a law jumps, by bisection. See docs/numerics.md.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import float64, int64, njit, void

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import (
    COMMAND_DRIVE,
    COMMAND_FORCE,
    LAW_FUNCTION,
    MEASURED_ACCELERATION,
    MEASURED_FLOORS,
    controller_step,
)
from mrpipe.dampers.drive import advance_lag
from mrpipe.dampers.hysteresis import follow_hysteresis
from mrpipe.dampers.plant import (
    CHAIN_FUNCTIONS,
    FIRST,
    WIRE_SIZE,
)
from mrpipe.simulation.implicit_force import (
    ITERATIONS,
    damper_force,
    narrowed,
    nearly_settled,
    next_guess,
    secant,
    settled,
    slope_between,
)
from mrpipe.simulation.parts import (
    D_COMMAND,
    D_CURRENT,
    I_COMMAND,
    I_DELAY,
    I_PER_SAMPLE,
    I_RECORD,
    I_STEPS,
    I_TRACK,
    P_ETA,
    P_EXPONENT,
    P_GAMMA_SHARE,
    P_VISCOSITY,
    P_YIELD,
    P_YIELD_DISPLACEMENT,
    R_DT,
    R_LAG,
    T_DESIRED,
    T_DRIVE,
    T_FORCE,
    T_GROUND,
    T_WORK_DAMPER,
    T_WORK_FRAME,
    T_WORK_IN,
    TRACK_BOUC_WEN,
    TRACK_DAMPER,
    TRACK_LAW,
    TRACK_SAMPLED,
    ideal_force,
    multiply,
    note,
    quadratic,
    sense,
)


@njit(inline="always")
def _plain_chain(
    track: int, parameters: FloatArray, dt: float
) -> tuple[float, tuple[float, ...], tuple[float, float, float]]:
    """Return the numbers of the plain chain: share of the lag, both polynomials, and the shape of the hysteresis."""
    if track != TRACK_BOUC_WEN:
        return 0.0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 0.5, 2.0)
    return (
        parameters[P_ETA] * dt,
        (
            parameters[P_YIELD], parameters[P_YIELD + 1], parameters[P_YIELD + 2], parameters[P_YIELD + 3],
            parameters[P_VISCOSITY], parameters[P_VISCOSITY + 1], parameters[P_VISCOSITY + 2],
            parameters[P_VISCOSITY + 3],
        ),
        (parameters[P_YIELD_DISPLACEMENT], parameters[P_GAMMA_SHARE], parameters[P_EXPONENT]),
    )  # fmt: skip


@njit(inline="always")
def _start_motion(z: FloatArray, w: FloatArray, M: FloatArray) -> tuple[float, float, float]:
    """Return displacement and velocity of the damper and the sum 1'M x at the start."""
    n = w.shape[0]
    x, v, pushed = 0.0, 0.0, 0.0
    for floor in range(n):
        x += w[floor] * z[floor]
        v += w[floor] * z[n + floor]
        for column in range(n):
            pushed += M[floor, column] * z[column]
    return x, v, pushed


@njit(inline="always")
def _first_force(track: int, run: FloatArray, chain: Any, motion: tuple[float, ...], wanted: float) -> float:
    """Return the force before the first step, and bring the state of the damper to it.

    `chain` holds the arguments of :func:`_force_at_end` from `functions` to `wire`; `motion` holds displacement,
    velocity, acceleration, drive and step.
    """
    functions, parameters, parameter_offsets, state_offsets, damper, trial, wire = chain
    x, v, a, drive, dt = motion
    if track == TRACK_LAW:
        return ideal_force(run, x, v)
    if track == TRACK_SAMPLED:
        return wanted
    wire[FIRST] = 1.0
    force = damper_force(
        functions, parameters, parameter_offsets, state_offsets, damper, trial, wire, 0.0, x, v, a, drive, dt
    )
    wire[FIRST] = 0.0
    for index in range(damper.shape[0]):
        damper[index] = trial[index]
    return force


@njit(inline="always")
def _force_at_end(
    track: int, run: FloatArray, functions: Any, parameters: FloatArray, parameter_offsets: IntArray,
    state_offsets: IntArray, damper: FloatArray, trial: FloatArray, wire: FloatArray, shape: tuple[float, float, float],
    hysteresis: tuple[float, ...], motion: tuple[float, ...], wanted: float, guess: float, slope: float,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return the force at the end of the step with the motion there: a secant, and bisection where a law jumps.

    Parameters
    ----------
    track, run
        How the desired force becomes a force, and numbers of the run.
    functions, parameters, parameter_offsets, state_offsets
        The chain. It is not given as a tuple, because counting the references to its arrays takes time.
    damper, trial, wire
        State of the chain at the start of the step and at its end, and its signals.
    shape
        Of the hysteresis of the plain chain: yield displacement, share of gamma, exponent.
    hysteresis
        Of the plain chain: yield force, viscosity, hysteretic variable, displacement and velocity of the rod at the
        start of the step.
    motion
        Displacement, velocity and acceleration without the force, what one newton adds to each, time, drive, step.
    wanted
        Desired force [N].
    guess, slope
        First guess of the force, and change of the answer of the damper with the force in the step before.

    Returns
    -------
    tuple
        Force, slope, and of the plain chain the hysteretic variable, displacement and velocity of the rod.
    """
    yield_displacement, gamma_share, exponent = shape
    yielding, viscous, hysteretic, rod, rod_speed = hysteresis
    x_free, v_free, a_free, end_x, end_v, end_a, time, drive, dt = motion
    real = track in (TRACK_DAMPER, TRACK_BOUC_WEN)
    zeta, x_end, v_end = 0.0, 0.0, 0.0
    found, slope_before = guess, slope
    last_guess, last_found = 0.0, 0.0
    low, high = -math.inf, math.inf
    for iteration in range(ITERATIONS):
        x_end, v_end = x_free + end_x * guess, v_free + end_v * guess
        if track == TRACK_BOUC_WEN:
            zeta = follow_hysteresis(
                hysteretic, rod, rod_speed, x_end, v_end, dt, yield_displacement, gamma_share, exponent
            )
            found = yielding * zeta + viscous * v_end
        elif track == TRACK_DAMPER:
            found = damper_force(
                functions, parameters, parameter_offsets, state_offsets, damper, trial, wire, time, x_end, v_end,
                a_free + end_a * guess, drive, dt,
            )  # fmt: skip
        elif track == TRACK_LAW:
            found = ideal_force(run, x_end, v_end)
        else:
            found = wanted
        if settled(found, guess):
            return found, slope, zeta, x_end, v_end
        if real and nearly_settled(found, guess):
            # the slope hardly changes from step to step: that of the step before is sufficient
            return secant(found, guess, slope), slope, zeta, x_end, v_end
        low, high = narrowed(low, high, found, guess)
        if iteration > 0 and guess != last_guess:
            slope = slope_between(found, guess, last_found, last_guess)
        last_guess, last_found = guess, found
        guess = next_guess(iteration, found, guess, slope, low, high)
        if guess == last_guess:
            break
    # a jump: any force within the bracket satisfies the law, and with the one found the damper sticks
    return guess, slope_before, zeta, x_end, v_end


# The functions below that run in each step have no arrays as arguments: counting the references to an array takes as
# long as their arithmetic.


@njit(inline="always")
def _output_due(step: int, delay: int, per_sample: int, to_output: int, active: int) -> tuple[int, int, bool]:
    """Return the counter to the next output, the sample that acts, and whether it acts from this step on."""
    jumped = False
    if step >= delay:
        if to_output == 0:
            active, to_output, jumped = active + 1, per_sample, True
        to_output -= 1
    return to_output, active, jumped


@njit(inline="always")
def _hold(
    track: int, run: FloatArray, counts: IntArray, damper: FloatArray, wanted: float, asked: float, force: float
) -> float:
    """Let a new command act and return the force: a controller holds its output, which does not change along a step."""
    if track == TRACK_SAMPLED:
        return wanted
    if run[R_LAG] == 1.0 and counts[I_COMMAND] >= 0:
        damper[counts[I_COMMAND]] = asked
    return force


@njit(inline="always")
def _drive_terms(polynomials: tuple[float, ...], u: float) -> tuple[float, float]:
    """Return yield force [N] and viscosity [N s/m] of the plain chain at the current u."""
    y0, y1, y2, y3, v0, v1, v2, v3 = polynomials
    return y0 + u * (y1 + u * (y2 + u * y3)), v0 + u * (v1 + u * (v2 + u * v3))


@njit(inline="always")
def _note_row(
    row: FloatArray, n: int, signals: tuple[float, float, float, float], works: tuple[float, float, float]
) -> None:
    """Write force, drive, desired force, ground acceleration and works into a row of the record."""
    tail = row[3 * n :]
    tail[T_FORCE], tail[T_DRIVE], tail[T_DESIRED], tail[T_GROUND] = signals
    tail[T_WORK_IN], tail[T_WORK_DAMPER], tail[T_WORK_FRAME] = works


@njit(inline="always")
def _works_after(
    works: tuple[float, float, float], ground: float, moved_mass: float, force: float, moved: float, losses: float
) -> tuple[float, float, float]:
    """Return the works of input, damper and frame [J] after a step; all but the works are sums over its two ends."""
    work_in, work_damper, work_frame = works
    return work_in - 0.5 * ground * moved_mass, work_damper + 0.5 * force * moved, work_frame + 0.5 * losses


@njit(
    void(
        int64[::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1],
        float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], float64[::1],
        CHAIN_FUNCTIONS, float64[::1], int64[::1], int64[::1], float64[::1],
        LAW_FUNCTION, float64[::1], int64[::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1],
    ),
    cache=True,
    nogil=True,
)  # fmt: skip
def run_loop(  # noqa: C901, PLR0915 - functions that take arrays in each step make it slower
    counts: IntArray, run: FloatArray, step_matrix: FloatArray, at_end: FloatArray, lower: FloatArray,
    gain: FloatArray, M: FloatArray, C: FloatArray, K: FloatArray, w: FloatArray, ground: FloatArray, z: FloatArray,
    functions: Any, parameters: FloatArray, parameter_offsets: IntArray, state_offsets: IntArray, damper: FloatArray,
    law: Any, numbers: FloatArray, layout: IntArray, memory: FloatArray, noise: FloatArray, commands: FloatArray,
    record: FloatArray,
) -> None:  # fmt: skip
    """Run the loop.

    Parameters
    ----------
    counts, run
        Integers and real numbers of the run, with the indices I_... and R_...
    step_matrix
        Transposed, shape (2n + 3, 2n + 4): from [z, ground before, ground after, force before] to the state after the
        step, followed by displacement, velocity and acceleration of the damper and the momentum-like sum 1'M x; all
        without the force at the end of the step.
    at_end
        Shape (2n + 4,): contribution of 1 N at the end of the step to these values.
    lower, gain
        Transposed lower half of A, shape (2n, n), and accelerations of one newton of damper force, shape (n,).
    M, C, K, w
        Of the frame; connectivity vector, shape (n,).
    ground
        Ground acceleration at every plant step, shape (steps + 1,) [m/s^2].
    z
        Initial state, shape (2n,); it is overwritten by the final state.
    functions, parameters, parameter_offsets, state_offsets, damper
        Chain and its state.
    law, numbers, layout, memory
        Controller and its state.
    noise
        Sensor noise of each controller sample, shape (samples, 5 + n).
    commands
        Filled, shape (samples, COMMAND_SIZE).
    record
        Filled, shape (records, 3n + T_SIZE).
    """
    n = w.shape[0]
    size = 2 * n
    track, delay, per_sample, dt = counts[I_TRACK], counts[I_DELAY], counts[I_PER_SAMPLE], run[R_DT]
    real = track in (TRACK_DAMPER, TRACK_BOUC_WEN)
    wire, measured = np.zeros(WIRE_SIZE), np.zeros(MEASURED_FLOORS + n)
    trial, before, after = np.zeros(damper.shape[0]), np.zeros(size + 3), np.zeros(size + 4)
    velocities, state = after[n:size], before[:size]
    drive, force, force_before, slope = 0.0, 0.0, 0.0, 0.0
    # the plain chain in separate variables: reading arrays through function pointers takes longer than the arithmetic
    eta_dt, polynomials, shape = _plain_chain(track, parameters, dt)
    yielding, viscous, hysteretic, rod, rod_speed = 0.0, 0.0, 0.0, 0.0, 0.0
    works, loss = (0.0, 0.0, 0.0), quadratic(C, z[n:])
    x, v, pushed = _start_motion(z, w, M)
    state[:] = z
    sample, active, written, to_sample, to_output, to_record = -1, -1, 0, 0, 0, 0
    wanted, asked = 0.0, 0.0
    for step in range(counts[I_STEPS] + 1):
        # counters instead of remainders, because integer division takes as long as the rest of the bookkeeping
        if to_sample == 0:
            sample, to_sample = sample + 1, per_sample
            sense(lower, gain, w, state, force, ground[step], noise[sample], measured)
            controller_step(law, numbers, layout, memory, measured, commands[sample])
        to_sample -= 1
        to_output, active, jumped = _output_due(step, delay, per_sample, to_output, active)
        if jumped:
            wanted, asked = commands[active, COMMAND_FORCE], commands[active, COMMAND_DRIVE]
        if step == 0:
            # all lags start in equilibrium with the first command, which may be delayed
            asked = commands[0, COMMAND_DRIVE]
            acceleration = measured[MEASURED_ACCELERATION] - noise[0, MEASURED_ACCELERATION]
            chain = (functions, parameters, parameter_offsets, state_offsets, damper, trial, wire)
            force = _first_force(track, run, chain, (x, v, acceleration, asked, dt), wanted)
            drive, rod, rod_speed, force_before = asked, x, v, force
        elif jumped:
            force = _hold(track, run, counts, damper, wanted, asked, force)
        if to_record == 0:
            to_record = counts[I_RECORD]
            note(lower, gain, M, K, state, force, record[written])
            _note_row(record[written], n, (force, drive, force if track == TRACK_LAW else wanted, ground[step]), works)
            written += 1
        to_record -= 1
        if step == counts[I_STEPS]:
            break
        # --- plant: all but the force at the end of the step
        drive += run[R_LAG] * (asked - drive)
        before[size], before[size + 1], before[size + 2] = ground[step], ground[step + 1], force
        multiply(step_matrix, before, after)
        # --- the force at the end of the step, with the motion there
        if track == TRACK_BOUC_WEN:
            # the command is known: only motion and hysteresis are not
            damper[D_CURRENT] = advance_lag(damper[D_CURRENT], damper[D_COMMAND], drive, eta_dt)
            damper[D_COMMAND] = drive
            yielding, viscous = _drive_terms(polynomials, damper[D_CURRENT])
        found, slope, hysteretic, rod, rod_speed = _force_at_end(
            track, run, functions, parameters, parameter_offsets, state_offsets, damper, trial, wire,
            shape, (yielding, viscous, hysteretic, rod, rod_speed),
            (after[size], after[size + 1], after[size + 2], at_end[size], at_end[size + 1], at_end[size + 2],
             (step + 1) * dt, drive, dt),
            wanted, 2.0 * force - force_before if real else force, slope,
        )  # fmt: skip
        for row_index in range(size + 4):
            after[row_index] += at_end[row_index] * found
        loss_end = quadratic(C, velocities)
        moved, moved_mass = after[size] - x, after[size + 3] - pushed
        works = _works_after(
            works, ground[step] + ground[step + 1], moved_mass, force + found, moved, (loss + loss_end) * dt
        )
        loss, x, pushed = loss_end, after[size], after[size + 3]
        force_before, force = force, found
        for index in range(size):
            before[index] = after[index]
        if track == TRACK_DAMPER:
            for index in range(damper.shape[0]):
                damper[index] = trial[index]
    z[:] = state
