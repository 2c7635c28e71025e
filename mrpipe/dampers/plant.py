"""The damper as a chain of steps: one contract for base forms, effects, bench simulation and closed loop.

A damper is an ordered tuple of *steps*. A step is a small numba function

    step(wire, state, parameters, dt)

that reads and writes the `wire` (an array of the quantities of one instant), stores its memory in `state` (zeros at the
start) and reads its numbers from `parameters`. All steps have the same compiled signature and are called through
function pointers (about 5 ns each), so that any chain runs in one compiled kernel without a new compilation.

The same chain serves the bench (:func:`run_chain` over recorded motion) and the closed loop (the simulation calls
:func:`advance` once a plant step). To try a step and reject it, copy `state` before and restore it afterwards.
"""

# ruff: noqa: ARG001 - all steps share one signature, used in full or not
from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numba import NumbaExperimentalFeatureWarning, float64, int64, njit, types, void

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.dampers.borrowed import borrowed
from mrpipe.dampers.timing import look_ahead
from mrpipe.errors import UserError

# numba warns that function pointers are experimental; with a fixed signature, as below, they are stable
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

# --- the wire -------------------------------------------------------------------------------------------------------
TIME = 0  # s
FIRST = 1  # 1.0 at the first call of a run, else 0.0: the time to set initial values in `state`
DISPLACEMENT = 2  # rod motion relative to the housing [m]; motion effects may change it
VELOCITY = 3  # m/s
ACCELERATION = 4  # m/s^2
DRIVE = 5  # command: coil current [A] or voltage [V]
CURRENT = 6  # effective drive after the driver's lag, u of (2.4)
YIELD_FORCE = 7  # alpha(u) z_max: force of the fully yielded hysteresis [N]
VISCOSITY = 8  # c0(u) [N s/m]
HYSTERESIS = 9  # hysteretic variable normalised to its limit, -1..1
HYSTERETIC_FORCE = 10  # YIELD_FORCE x HYSTERESIS [N]
VISCOUS_FORCE = 11  # N
EXTRA_FORCE = 12  # force of the base form that no linear coefficient scales, such as that of an inner spring [N]
FORCE = 13  # force at the load cell [N]; at the start of a step the force of the step before
WORK = 14  # energy dissipated since the start [J]
SLIP = 15  # path since the last reversal [m]
SINCE_REVERSAL = 16  # time since the last reversal [s]
PAST_CURRENT = 17  # largest |effective current| so far in this run [A]
RATE_YIELD = 18  # factor of YIELD_FORCE that does not change when the damper yields: rate, effects (1 where unused)
PART_FORCE = 19  # force of a second yielding part [N], from its own law of the drive (0 where a form has none)
PART = 20  # normalised force of the second yielding part, -1..1
SUM_VELOCITY = 21  # velocity that the sum of (2.1) used: that of the inner element where a form has one [m/s]
INNER_DISPLACEMENT = 22  # deformation of an inner element [m]
OUTER_VELOCITY = 23  # velocity of the rod while VELOCITY holds that of an inner element [m/s]
YIELD_LOSS = 24  # share of the yield force that effects remove, such as warm fluid (0 where unused)
WIRE_SIZE = 25

BOOKKEEPING = 6
"""Number of values that :func:`advance` stores after the state of the steps: work, slip, time since the last reversal,
largest current, last velocity, last force."""

RESTING = 1e-30
"""Size of the last velocity [m/s] while the rod rests: its sign is the direction of the motion before."""

STEP_SIGNATURE = void(float64[::1], float64[::1], float64[::1], float64)
"""The one compiled signature of a step: `@njit(STEP_SIGNATURE, cache=True)`."""

CHAIN_LENGTH = 16
"""Largest number of steps of a chain; shorter chains are padded with a step that does nothing."""


class Phase(IntEnum):
    """Place of a step in the chain; a chain is sorted by phase, and within a phase by the given order."""

    MOTION = 10  # rod motion before the damper (bearing play, compliance)
    CURRENT = 20  # drive -> effective current (the base's lag)
    CURRENT_EFFECT = 25  # effects on the effective current (remanence, second lag)
    COEFFICIENTS = 30  # effective current -> yield force and viscosity
    COEFFICIENT_EFFECT = 35  # effects on both (heating, Stribeck, migration)
    HYSTERESIS = 40  # the hysteretic variable
    SUM = 50  # HYSTERETIC_FORCE + VISCOUS_FORCE
    FORCE_EFFECT = 60  # forces in parallel (accumulator, inertia, end stop)
    SENSOR = 70  # effects of the load cell on the measured force


@dataclass(frozen=True)
class Step:
    """One step of a chain, with its numbers.

    Attributes
    ----------
    name
        Name for messages.
    phase
        Place in the chain.
    function
        Compiled with :data:`STEP_SIGNATURE`.
    parameters
        Numbers of the step, shape (p,), SI.
    state_size
        Length of the memory of the step.
    ahead_s
        Time [s] by which the step needs the motion after the present instant, because the recorded displacement is
        late. Only recordings can provide it; a closed loop runs without such steps.
    back_s, kept
        Time [s] before the present instant that the step reads, and number of samples that its memory stores for this.
    filters_force
        Whether the step replaces the force by a linear filter of the force. A fit then filters each part of the force
        separately.
    """

    name: str
    phase: Phase
    function: Any
    parameters: FloatArray
    state_size: int = 0
    ahead_s: float = 0.0
    back_s: float = 0.0
    kept: int = 0
    filters_force: bool = False


@dataclass(frozen=True)
class Chain:
    """Steps in the layout that compiled kernels read.

    Attributes
    ----------
    functions
        Functions of the steps, padded to :data:`CHAIN_LENGTH`.
    parameters, parameter_offsets, state_offsets
        Numbers of all steps in one array; index of the first number, and of the first state, of each step.
    names
        Names of the steps.
    ahead_s, memories
        See :class:`Step`.
    filters
        Indices of the steps that filter the force.
    """

    functions: tuple[Any, ...]
    parameters: FloatArray
    parameter_offsets: IntArray
    state_offsets: IntArray
    names: tuple[str, ...]
    ahead_s: float = 0.0
    memories: tuple[tuple[str, float, int], ...] = ()
    filters: tuple[int, ...] = ()

    def check_interval(self, dt: float) -> None:
        """Raise UserError if a step reads further back than its memory reaches at this interval [s]."""
        for name, back_s, kept in self.memories:
            if back_s > (kept - 2) * dt:
                raise UserError(
                    "damper model",
                    name,
                    f"looks back {back_s:.4g} s, its memory of {kept} samples reaches {(kept - 2) * dt:.4g} s at "
                    f"{1.0 / dt:.6g} Hz",
                    "use a lower sampling rate (prepare.working_rate_hz, simulate.plant_rate_hz) or a shorter time",
                )

    @property
    def state_size(self) -> int:
        """Length of the state of the whole chain."""
        return int(self.state_offsets[-1])

    @property
    def arguments(self) -> tuple[Any, ...]:
        """Return (functions, parameters, parameter_offsets, state_offsets), the first arguments of :func:`advance`."""
        return self.functions, self.parameters, self.parameter_offsets, self.state_offsets


@njit(void(float64[::1], float64), cache=True)
def change_yield_force(wire: FloatArray, factor: float) -> None:
    """Multiply the yield force by a factor before the damper yields, for steps of Phase.COEFFICIENT_EFFECT.

    The result differs from a factor on the hysteretic force if the form has a spring in series with the slider, or a
    yield velocity that grows with the yield force, because the yield force then also determines when the damper yields.
    """
    wire[YIELD_FORCE] *= factor
    wire[YIELD_LOSS] = 1.0 - (1.0 - wire[YIELD_LOSS]) * factor


@njit(STEP_SIGNATURE, cache=True)
def idle_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Do nothing: padding of short chains."""


@njit(STEP_SIGNATURE, cache=True)
def sum_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Compute the sum (2.1): f = alpha z + c0 v, plus the second yielding part if the form has one."""
    wire[HYSTERETIC_FORCE] = wire[YIELD_FORCE] * wire[RATE_YIELD] * wire[HYSTERESIS] + wire[PART_FORCE] * wire[PART]
    wire[SUM_VELOCITY] = wire[VELOCITY]
    wire[VISCOUS_FORCE] = wire[VISCOSITY] * wire[VELOCITY]
    wire[FORCE] = wire[HYSTERETIC_FORCE] + wire[VISCOUS_FORCE]


def in_order(steps: Sequence[Step]) -> list[Step]:
    """Return the steps sorted by phase, with the sum of (2.1)."""
    return sorted([*steps, Step("sum", Phase.SUM, sum_step, np.zeros(0))], key=lambda step: step.phase)


def build_chain(steps: Sequence[Step]) -> Chain:
    """Sort the steps by phase and pack them; the step of the sum (2.1) is added.

    Raises
    ------
    UserError
        If there are more than :data:`CHAIN_LENGTH` steps.
    """
    ordered = in_order(steps)
    if len(ordered) > CHAIN_LENGTH:
        raise UserError(
            "damper model",
            ", ".join(step.name for step in ordered),
            f"makes a chain of {len(ordered)} steps, at most {CHAIN_LENGTH} are possible",
            "leave out effects, or choose forms with fewer steps",
        )
    padding = CHAIN_LENGTH - len(ordered)
    parameters = [np.ascontiguousarray(step.parameters, dtype=np.float64) for step in ordered]
    return Chain(
        functions=tuple(step.function for step in ordered) + (idle_step,) * padding,
        parameters=np.concatenate([*parameters, np.zeros(1)]),
        parameter_offsets=np.cumsum([0, *(len(values) for values in parameters)], dtype=np.int64),
        state_offsets=np.cumsum([0, *(step.state_size for step in ordered)], dtype=np.int64),
        names=tuple(step.name for step in ordered),
        ahead_s=sum(step.ahead_s for step in ordered),
        memories=tuple((step.name, step.back_s, step.kept) for step in ordered if step.back_s > 0.0),
        filters=tuple(place for place, step in enumerate(ordered) if step.filters_force),
    )


CHAIN_FUNCTIONS = types.UniTuple(types.FunctionType(STEP_SIGNATURE), CHAIN_LENGTH)
"""Compiled type of the functions of a chain, for the signatures of kernels."""


@njit(void(float64[::1], int64, float64[::1], float64), cache=True)
def begin_step(state: FloatArray, memory: int, wire: FloatArray, dt: float) -> None:
    """Prepare the wire for the steps of a chain, from the motion and the drive on it and the bookkeeping of the state.

    Parameters
    ----------
    state
        State of the chain, followed by the bookkeeping from index `memory` on: work, slip, time since reversal, largest
        current so far, last velocity (at rest :data:`RESTING` in the direction before), last force.
    memory
        Length of the state of the steps.
    wire
        Contains time, mark of the first sample, displacement, velocity, acceleration and drive.
    dt
        Time since the last sample [s].
    """
    if wire[FIRST] > 0.5:
        for index in range(memory, memory + BOOKKEEPING):
            state[index] = 0.0
        state[memory + 4] = wire[VELOCITY]
    else:
        # the velocity is linear between the samples, so that a reversal is not moved to the next sample
        speed, speed_before, since = abs(wire[VELOCITY]), abs(state[memory + 4]), dt
        if wire[VELOCITY] * state[memory + 4] < 0.0:
            since *= speed / (speed + speed_before)
            speed_before = 0.0
            state[memory + 1] = 0.0
            state[memory + 2] = 0.0
        state[memory + 1] += 0.5 * (speed_before + speed) * since
        state[memory + 2] += since
        # where the rod rests, the direction before is kept, with a speed that does not count
        state[memory + 4] = wire[VELOCITY] if speed > 0.0 else math.copysign(RESTING, state[memory + 4])
    for index in range(CURRENT, WIRE_SIZE):
        wire[index] = 0.0
    wire[FORCE] = state[memory + 5]
    wire[WORK] = state[memory]
    wire[SLIP] = state[memory + 1]
    wire[SINCE_REVERSAL] = state[memory + 2]
    wire[PAST_CURRENT] = state[memory + 3]
    wire[CURRENT] = wire[DRIVE]
    wire[RATE_YIELD] = 1.0


@njit(void(float64[::1], int64, float64[::1], float64), cache=True)
def end_step(state: FloatArray, memory: int, wire: FloatArray, dt: float) -> None:
    """Update the bookkeeping after the steps of a chain; arguments as in :func:`begin_step`."""
    state[memory] += (wire[HYSTERETIC_FORCE] + wire[VISCOUS_FORCE]) * wire[VELOCITY] * dt
    state[memory + 3] = max(state[memory + 3], abs(wire[CURRENT]))
    state[memory + 5] = wire[FORCE]


@njit(
    void(CHAIN_FUNCTIONS, float64[::1], int64[::1], int64[::1], float64[::1], float64[::1], float64),
    cache=True,
)
def advance(
    functions: Any,
    parameters: FloatArray,
    parameter_offsets: IntArray,
    state_offsets: IntArray,
    state: FloatArray,
    wire: FloatArray,
    dt: float,
) -> None:
    """Advance the chain by one step: set TIME, FIRST and the motion and drive on the wire first, read FORCE after.

    `state` contains the state of the steps followed by the bookkeeping (see :func:`new_state`); WORK, SLIP,
    SINCE_REVERSAL and PAST_CURRENT are kept here for all steps to read. WORK counts the force of the step before. At
    the start FORCE is the force of the step before, and everything else that steps write is 0: the force depends on
    `state`, motion and drive alone, independent of trials of a solver on the same wire.
    """
    memory = state_offsets[-1]
    begin_step(state, memory, wire, dt)
    kept, numbers = borrowed(state), borrowed(parameters)
    for index in range(parameter_offsets.shape[0] - 1):
        functions[index](
            wire,
            kept[state_offsets[index] : state_offsets[index + 1]],
            numbers[parameter_offsets[index] : parameter_offsets[index + 1]],
            dt,
        )
    end_step(state, memory, wire, dt)


@njit(
    void(
        CHAIN_FUNCTIONS, float64[::1], int64[::1], int64[::1], float64[::1], float64[::1], float64[::1], float64[::1],
        float64, float64[:, ::1],
    ),
    cache=True,
)  # fmt: skip
def _run(
    functions: Any,
    parameters: FloatArray,
    parameter_offsets: IntArray,
    state_offsets: IntArray,
    displacement: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    drive: FloatArray,
    dt: float,
    wires: FloatArray,
) -> None:
    state = np.zeros(state_offsets[-1] + BOOKKEEPING)
    wire = np.zeros(WIRE_SIZE)
    for index in range(displacement.shape[0]):
        wire[TIME] = index * dt
        wire[FIRST] = 1.0 if index == 0 else 0.0
        wire[DISPLACEMENT] = displacement[index]
        wire[VELOCITY] = velocity[index]
        wire[ACCELERATION] = acceleration[index]
        wire[DRIVE] = drive[index]
        advance(functions, parameters, parameter_offsets, state_offsets, state, wire, dt)
        wires[index, :] = wire


def new_state(chain: Chain) -> FloatArray:
    """Return an initial state for :func:`advance`: that of the steps, and :data:`BOOKKEEPING` more values."""
    return np.zeros(chain.state_size + BOOKKEEPING)


def run_chain(
    chain: Chain,
    displacement: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    drive: FloatArray,
    dt: float,
) -> FloatArray:
    """Run the chain over recorded motion.

    Parameters
    ----------
    chain
        Steps of the damper.
    displacement, velocity, acceleration, drive
        Shape (n,); m, m/s, m/s^2, A or V.
    dt
        Sampling interval [s].

    Returns
    -------
    Shape (n, WIRE_SIZE): the wire after each step; column FORCE is the damper force [N].

    Raises
    ------
    UserError
        If a step looks back further than its memory reaches at this interval.
    """
    chain.check_interval(float(dt))
    wires = np.empty((len(displacement), WIRE_SIZE))
    x, v, a, u = (
        np.ascontiguousarray(item, dtype=np.float64) for item in (displacement, velocity, acceleration, drive)
    )
    if chain.ahead_s:
        x, v, a = look_ahead(x, v, a, np.array([0, len(x)]), np.array([dt]), chain.ahead_s)
    _run(*chain.arguments, x, v, a, u, float(dt), wires)
    return wires
