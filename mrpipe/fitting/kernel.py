"""One compiled loop over all tests that records the signals which a fit needs, and the forces of tapped steps.

The steps are prepared and ended by the same functions as in :func:`mrpipe.dampers.plant.advance`. The loop over the
steps is separate, because it records values between steps: after the step of the coefficients and after each tapped
step.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64, njit, void

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.dampers.borrowed import borrowed
from mrpipe.dampers.drive import COEFFICIENT_STEPS
from mrpipe.dampers.plant import (
    ACCELERATION,
    BOOKKEEPING,
    CURRENT,
    DISPLACEMENT,
    DRIVE,
    EXTRA_FORCE,
    FIRST,
    FORCE,
    HYSTERESIS,
    PART,
    RATE_YIELD,
    SUM_VELOCITY,
    TIME,
    VELOCITY,
    VISCOSITY,
    WIRE_SIZE,
    YIELD_FORCE,
    Chain,
    begin_step,
    end_step,
)
from mrpipe.dampers.timing import look_ahead
from mrpipe.fitting.pointers import addresses_of, step_at
from mrpipe.fitting.recordings import Recordings

COLUMNS = 11
CURRENT_AT, VELOCITY_AT, HYSTERESIS_AT, YIELD_AT, VISCOSITY_AT, FORCE_AT, WORK_AT, DISPLACEMENT_AT = range(8)
SUM_VELOCITY_AT, PART_AT, KNOWN_AT = 8, 9, 10
"""Rows of the result of :func:`run_recordings`: effective drive [A or V], velocity of the damper [m/s], hysteretic
variable z [1], factors by which effects change yield force and viscosity [1], force [N], work [J], displacement [m],
velocity of the viscous element [m/s], second yielding part [1], force of the base form that no linear coefficient
scales [N].
"""


@njit(
    void(
        int64[::1],
        float64[::1],
        int64[::1],
        int64[::1],
        float64[::1],
        float64[::1],
        float64[::1],
        float64[::1],
        int64[::1],
        float64[::1],
        int64,
        int64[::1],
        float64[:, ::1],
    ),
    cache=True,
    nogil=True,
)
def _run(
    addresses: IntArray,
    parameters: FloatArray,
    parameter_offsets: IntArray,
    state_offsets: IntArray,
    displacement: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    drive: FloatArray,
    starts: IntArray,
    dt: FloatArray,
    coefficients_at: int,
    tapped: IntArray,
    result: FloatArray,
) -> None:
    memory = state_offsets[-1]
    count = parameter_offsets.shape[0] - 1
    kept = np.zeros(memory + BOOKKEEPING)
    state, values = borrowed(kept), borrowed(parameters)
    wire = np.zeros(WIRE_SIZE)
    for test in range(starts.shape[0] - 1):
        step = dt[test]
        state[:] = 0.0
        for index in range(starts[test], starts[test + 1]):
            wire[TIME] = (index - starts[test]) * step
            wire[FIRST] = 1.0 if index == starts[test] else 0.0
            wire[DISPLACEMENT] = displacement[index]
            wire[VELOCITY] = velocity[index]
            wire[ACCELERATION] = acceleration[index]
            wire[DRIVE] = drive[index]
            begin_step(state, memory, wire, step)
            yields = 1.0
            viscous = 1.0
            tap = 0
            for k in range(count):
                before = wire[FORCE]
                step_at(addresses[k])(
                    wire,
                    state[state_offsets[k] : state_offsets[k + 1]],
                    values[parameter_offsets[k] : parameter_offsets[k + 1]],
                    step,
                )
                if k == coefficients_at:
                    yields = wire[YIELD_FORCE]
                    viscous = wire[VISCOSITY]
                if tap < tapped.shape[0] and k == tapped[tap]:
                    result[COLUMNS + tap, index] = wire[FORCE] - before
                    tap += 1
            end_step(state, memory, wire, step)
            result[CURRENT_AT, index] = wire[CURRENT]
            result[VELOCITY_AT, index] = wire[VELOCITY]
            result[HYSTERESIS_AT, index] = wire[HYSTERESIS] * wire[RATE_YIELD]
            result[YIELD_AT, index] = wire[YIELD_FORCE] / yields if abs(yields) > 1e-12 else 1.0
            result[VISCOSITY_AT, index] = wire[VISCOSITY] / viscous if abs(viscous) > 1e-12 else 1.0
            result[FORCE_AT, index] = wire[FORCE]
            result[WORK_AT, index] = state[memory]
            result[DISPLACEMENT_AT, index] = wire[DISPLACEMENT]
            result[SUM_VELOCITY_AT, index] = wire[SUM_VELOCITY]
            result[PART_AT, index] = wire[PART]
            result[KNOWN_AT, index] = wire[EXTRA_FORCE]
    kept[0] = 0.0  # keeps the memory of the state alive until here, because `state` does not


def run_recordings(chain: Chain, recordings: Recordings, tapped: tuple[int, ...] = ()) -> FloatArray:
    """Run a chain over all tests.

    Parameters
    ----------
    chain
        Chain that contains one step of :func:`mrpipe.dampers.drive.coefficients`.
    recordings
        The tests.
    tapped
        Places in the chain, in rising order. The force that each of these steps adds is recorded in a separate row.

    Returns
    -------
    Shape (COLUMNS + len(tapped), n).
    """
    chain.check_interval(float(np.min(recordings.dt)))
    result = np.empty((COLUMNS + len(tapped), len(recordings.force)))
    motion = recordings.displacement, recordings.velocity, recordings.acceleration
    if chain.ahead_s:
        motion = look_ahead(*motion, recordings.starts, recordings.dt, chain.ahead_s)
    _run(
        addresses_of(chain),
        *chain.arguments[1:],
        *motion,
        recordings.drive,
        recordings.starts,
        recordings.dt,
        next(place for place, name in enumerate(chain.names) if name in COEFFICIENT_STEPS),
        np.array(tapped, dtype=np.int64),
        result,
    )
    return result


@njit(
    void(int64, float64[::1], int64, int64[::1], float64[::1], float64[:, ::1]),
    cache=True,
    nogil=True,
)
def _filter_rows(
    address: int, parameters: FloatArray, state_size: int, starts: IntArray, dt: FloatArray, rows: FloatArray
) -> None:
    wire = np.zeros(WIRE_SIZE)
    state = np.zeros(state_size)
    for row in range(rows.shape[0]):
        for test in range(starts.shape[0] - 1):
            state[:] = 0.0
            for index in range(starts[test], starts[test + 1]):
                wire[FIRST] = 1.0 if index == starts[test] else 0.0
                wire[FORCE] = rows[row, index]
                step_at(address)(wire, state, parameters, dt[test])
                rows[row, index] = wire[FORCE]


def filter_parts(chain: Chain, parts: FloatArray, recordings: Recordings) -> FloatArray:
    """Return parts of the force after the filters of the force channel, shape (c, n) [N].

    A filter is linear, so the measured force is the sum of the filtered parts.

    Parameters
    ----------
    chain
        Chain whose force-filter steps are applied, with a separate state for each part and test.
    parts
        Shape (c, n) [N].
    recordings
        The tests that the parts belong to.
    """
    parts = np.ascontiguousarray(parts)
    for place in chain.filters:
        begin, end = chain.parameter_offsets[place : place + 2]
        size = int(chain.state_offsets[place + 1] - chain.state_offsets[place])
        address = int(addresses_of(chain)[place])
        parameters = np.ascontiguousarray(chain.parameters[begin:end])
        _filter_rows(address, parameters, size, recordings.starts, recordings.dt, parts)
    return parts
