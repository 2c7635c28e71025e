"""The closed loop of a structure with several dampers: each with its own model, brace and controller.

::

    dampers = [LoopDamper("base", w1, model.chain(), controller1), LoopDamper("top", w2, None, controller2)]
    response = simulate_dampers(frame, dampers, excitation, LoopOptions())
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.central import CentralRegulator
from mrpipe.control.controller import Controller
from mrpipe.control.kernel import (
    COMMAND_SIZE,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_GROUND,
)
from mrpipe.control.laws import is_linear
from mrpipe.dampers.drive import command_place
from mrpipe.dampers.plant import Chain, build_chain, new_state
from mrpipe.errors import DivergedError, UserError
from mrpipe.signals.discretisation import discretise_first_order
from mrpipe.simulation import several_dampers_parts as parts
from mrpipe.simulation.checks import check_loop
from mrpipe.simulation.clock import clock_of
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.inputs import Inputs, inputs_of
from mrpipe.simulation.loop import LoopOptions, Response, base_shear
from mrpipe.simulation.sensors import add_fault, sensor_noise
from mrpipe.simulation.several_dampers_kernel import compiled
from mrpipe.structures import Frame, state_space


@dataclass(frozen=True)
class LoopDamper:
    """One damper of the loop.

    Attributes
    ----------
    name
        Name of the damper in messages and tables.
    position
        Connectivity vector w of damper and brace together, shape (n,).
    chain
        The damper with its effects; None with perfect tracking.
    controller
        Controller of this damper.
    brace_n_m
        Stiffness of the brace in series with the damper [N/m]; infinite: rigid.
    central
        Whether the central regulator gives its desired force.
    """

    name: str
    position: FloatArray
    chain: Chain | None
    controller: Controller
    brace_n_m: float = math.inf
    central: bool = False


@dataclass(frozen=True)
class DampersResponse:
    """Response of a loop with several dampers.

    Attributes
    ----------
    dampers
        Name of a damper -> the response as with this damper alone: histories of the floors, which are the same for
        all, and displacement, force, drive, commands and work of this damper.
    work_dampers
        Dissipated by all dampers together since the start [J], shape (m,).
    """

    dampers: dict[str, Response]
    work_dampers: FloatArray

    @property
    def first(self) -> Response:
        """The response of the first damper."""
        return next(iter(self.dampers.values()))

    @property
    def energy_balance_error(self) -> float:
        """Largest error of the energy balance, relative to the energy that was stored or dissipated [1]."""
        return replace(self.first, work_damper=self.work_dampers).energy_balance_error

    @property
    def together(self) -> Response:
        """The response of the first damper with those of all others, for largest values over all dampers."""
        first, *others = self.dampers.values()
        return replace(first, others=tuple(others))


def simulate_dampers(
    frame: Frame,
    dampers: Sequence[LoopDamper],
    excitation: Excitation,
    options: LoopOptions | None = None,
    *,
    regulator: CentralRegulator | None = None,
    rng: np.random.Generator | None = None,
    initial_state: FloatArray | None = None,
) -> DampersResponse:
    """Run the loop.

    Parameters
    ----------
    frame
        Structure.
    dampers
        One or more dampers; their controllers have the same rate.
    excitation
        Excitation of the structure; its duration is that of the run.
    options
        Options of the loop.
    regulator
        Regulator of the dampers with `central`.
    rng
        Generator of the sensor noise; needed where there is some.
    initial_state
        [x, v] of the floors at the start, shape (2n,); rest if left out.

    Raises
    ------
    UserError
        If a damper does not suit the structure or the options.
    DivergedError
        If the response grows without bound.
    """
    options = options or LoopOptions()
    n, k = frame.floors, len(dampers)
    _check(frame, dampers, options)
    rate = dampers[0].controller.options.rate_hz
    clock = clock_of(excitation.duration_s, rate, options.plant_rate_hz, options.record_rate_hz)
    dt, samples = clock.dt, clock.samples
    inputs = inputs_of(frame, excitation)
    positions = np.ascontiguousarray([item.position for item in dampers], dtype=np.float64)
    counts = np.zeros(parts.I_SIZE, dtype=np.int64)
    counts[parts.I_STEPS], counts[parts.I_PER_SAMPLE], counts[parts.I_RECORD] = (
        clock.steps,
        clock.per_sample,
        clock.every,
    )
    counts[parts.I_DELAY] = round(options.delay_s / dt)
    counts[parts.I_TRACK] = {"damper": parts.TRACK_DAMPER, "ideal": parts.TRACK_SAMPLED}.get(
        options.tracking, parts.TRACK_LAW
    )
    chains = [item.chain or build_chain([]) for item in dampers]
    for chain in chains:
        chain.check_interval(dt)
    commands = np.zeros((k, samples, COMMAND_SIZE))
    record = np.zeros((clock.records, 3 * n + k * parts.T_DEVICE + parts.T_INPUTS + inputs.count))
    z = np.zeros(2 * n) if initial_state is None else np.array(initial_state, dtype=np.float64)
    began = time.perf_counter()
    compiled(k)(
        counts, dt, _plant(frame, inputs, positions, dt), positions, _devices(dampers, chains, options, dt),
        clock.inputs(excitation), z,
        *_packed_chains(chains), *_packed_controllers(dampers), *_packed_regulator(frame, dampers, regulator),
        _noise(dampers, options, samples, n, rng), commands, record,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    if not np.all(np.isfinite(record)):
        laws = ", ".join(item.controller.law for item in dampers)
        raise DivergedError(f"laws {laws}: the response grows without bound; lower the negative stiffness")
    return _response(record, commands, dampers, frame, inputs, dt * clock.every, dt * clock.per_sample, seconds)


def _check(frame: Frame, dampers: Sequence[LoopDamper], options: LoopOptions) -> None:
    if not dampers:
        raise UserError("structure", "dampers", "there is none", "give at least one damper")
    check_loop(frame, options)
    for item in dampers:
        where = f"structure.dampers: {item.name}"
        if item.position.shape != (frame.floors,):
            raise UserError(where, "between", f"{item.position.size} entries", f"the structure has {frame.floors}")
        if item.controller.options.rate_hz != dampers[0].controller.options.rate_hz:
            raise UserError(where, "rate_hz", "differs from that of the first damper", "give all controllers one rate")
        if options.tracking == "damper" and item.chain is None:
            raise UserError(where, "damper", "there is none", "give a damper or tracking: ideal")
        if options.tracking == "ideal" and not math.isinf(item.brace_n_m):
            raise UserError(
                where,
                "brace_stiffness_n_m",
                "cannot carry a force that jumps from sample to sample, as simulate.tracking: ideal gives it",
                "set tracking to damper or continuous, or leave the brace out",
            )
        if options.tracking in ("continuous", "unclipped") and not is_linear(item.controller.law):
            raise UserError(
                "simulate",
                "tracking",
                f"law {item.controller.law} cannot run in continuous time",
                "give ideal or damper",
            )


def _plant(frame: Frame, inputs: Inputs, positions: FloatArray, dt: float) -> tuple[FloatArray, ...]:
    n, m = frame.floors, inputs.count
    # the first column of the state space is the ground motion, which is among the inputs here
    space = state_space(frame, np.column_stack([inputs.loads, -positions.T]))
    B = space.B[:, 1:]
    Ad, B0, B1 = discretise_first_order(space.A, B, dt)
    step_matrix = np.column_stack([Ad, B0[:, :m], B1[:, :m], B0[:, m:]])
    columns = np.vstack([inputs.influence.T, -inputs.loads.T, inputs.direct(frame).T])
    arrays = (step_matrix.T, B1[:, m:].T, space.A[n:].T, B[n:, m:].T,
              frame.mass, frame.damping, frame.stiffness, columns)  # fmt: skip
    return tuple(np.ascontiguousarray(item, dtype=np.float64) for item in arrays)


def _devices(dampers: Sequence[LoopDamper], chains: Sequence[Chain], options: LoopOptions, dt: float) -> FloatArray:
    lag = options.driver_time_constant_s
    rows = np.zeros((len(dampers), parts.D_SIZE))
    for row, item, chain in zip(rows, dampers, chains, strict=True):
        row[parts.D_C], row[parts.D_K] = item.controller.gains.c_n_s_m, item.controller.gains.k_n_m
        row[parts.D_CLIPPED] = 0.0 if options.tracking == "unclipped" else 1.0
        row[parts.D_FLEXIBILITY] = 1.0 / item.brace_n_m
        row[parts.D_LAG] = 1.0 if lag <= 0.0 else -math.expm1(-dt / lag)
        row[parts.D_COMMAND] = command_place(chain)
    return rows


def _packed_chains(chains: Sequence[Chain]) -> tuple[Any, ...]:
    states = [new_state(chain) for chain in chains]
    offsets = (
        np.ascontiguousarray([chain.parameter_offsets for chain in _padded(chains)]),
        np.ascontiguousarray([chain.state_offsets for chain in _padded(chains)]),
        _starts([len(chain.parameters) for chain in chains]),
        _starts([len(state) for state in states]),
    )
    parameters = np.concatenate([chain.parameters for chain in chains])
    return tuple(chain.functions for chain in chains), parameters, offsets, np.concatenate(states)


def _padded(chains: Sequence[Chain]) -> list[Chain]:
    """Return the chains with as many steps as the longest; steps that are added have no numbers and no memory."""
    length = max(len(chain.parameter_offsets) for chain in chains)

    def longer(offsets: Any) -> Any:
        return np.concatenate([offsets, np.full(length - len(offsets), offsets[-1])]).astype(np.int64)

    return [
        replace(chain, parameter_offsets=longer(chain.parameter_offsets), state_offsets=longer(chain.state_offsets))
        for chain in chains
    ]


def _packed_controllers(dampers: Sequence[LoopDamper]) -> tuple[Any, ...]:
    controllers = [item.controller for item in dampers]
    memories = [item.new_state() for item in controllers]
    packed = ([item.numbers for item in controllers], [item.layout for item in controllers], memories)
    places = np.column_stack([_starts([len(array) for array in arrays]) for arrays in packed])
    numbers, layouts, states = (np.concatenate(arrays) for arrays in packed)
    return tuple(item.force for item in controllers), numbers, layouts, np.ascontiguousarray(places), states


def _starts(lengths: Sequence[int]) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _packed_regulator(
    frame: Frame, dampers: Sequence[LoopDamper], regulator: CentralRegulator | None
) -> tuple[Any, ...]:
    members = np.array([place for place, item in enumerate(dampers) if item.central], dtype=np.int64)
    if regulator is None or not len(members):
        n = 2 * frame.floors
        empty = (np.zeros((n, n)), np.zeros((n, 1)), np.zeros((n, 1)), np.zeros((1, n)), np.zeros((0, 2)))
        return empty, np.zeros(0, dtype=np.int64)
    sensors = [(members[0], MEASURED_GROUND)]
    sensors += [(members[place], MEASURED_DISPLACEMENT) for place in regulator.sensors.dampers]
    sensors += [(members[0], MEASURED_FLOORS + place) for place in regulator.sensors.accelerometers]
    arrays = (regulator.transition, regulator.force_input, regulator.innovation, regulator.gain, np.array(sensors))
    return tuple(np.ascontiguousarray(item, dtype=np.float64) for item in arrays), members


def _noise(
    dampers: Sequence[LoopDamper], options: LoopOptions, samples: int, floors: int, rng: np.random.Generator | None
) -> FloatArray:
    """Return sensor noise, shape (dampers, samples, 5 + n); the accelerometers of ground and floors are shared."""
    result = np.stack([sensor_noise(options.noise, samples, floors, rng) for _ in dampers])
    result[1:, :, MEASURED_GROUND] = result[0, :, MEASURED_GROUND]
    result[1:, :, MEASURED_FLOORS:] = result[0, :, MEASURED_FLOORS:]
    if options.fault is not None:
        for noise in result:
            add_fault(noise, options.fault, rng)
    return np.ascontiguousarray(result)


def _response(
    record: FloatArray,
    commands: FloatArray,
    dampers: Sequence[LoopDamper],
    frame: Frame,
    inputs: Inputs,
    dt: float,
    command_dt: float,
    seconds: float,
) -> DampersResponse:
    n, k = frame.floors, len(dampers)
    tail = record[:, 3 * n + k * parts.T_DEVICE :]
    histories = tail[:, parts.T_INPUTS :]
    absolute = record[:, 2 * n : 3 * n]
    shear = base_shear(frame, absolute) - np.einsum("ti,i->t", histories, inputs.pushed(frame))
    moved = np.einsum("ti,fi->tf", histories, inputs.influence)
    found: dict[str, Response] = {}
    for place, item in enumerate(dampers):
        own = record[:, 3 * n + place * parts.T_DEVICE :]
        found[item.name] = Response(
            time_s=dt * np.arange(len(record), dtype=np.float64),
            displacement=record[:, :n],
            velocity=record[:, n : 2 * n],
            acceleration=absolute - moved,
            absolute_acceleration=absolute,
            damper_displacement=own[:, parts.T_X],
            damper_velocity=own[:, parts.T_V],
            force=own[:, parts.T_FORCE],
            drive=own[:, parts.T_DRIVE],
            desired_force=own[:, parts.T_DESIRED],
            ground_acceleration=histories[:, 0],
            base_shear=shear,
            work_in=tail[:, parts.T_WORK_IN],
            work_damper=own[:, parts.T_WORK],
            work_frame=tail[:, parts.T_WORK_FRAME],
            energy=tail[:, parts.T_ENERGY],
            commands=commands[place],
            command_time_s=command_dt * np.arange(commands.shape[1], dtype=np.float64),
            seconds=seconds,
            floors=frame.moved_by_ground,
        )
    works = np.sum([item.work_damper for item in found.values()], axis=0)
    return DampersResponse(found, np.asarray(works))
