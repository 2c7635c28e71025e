"""The closed loop as one plain function: frame, damper, controller and excitation in, response out."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.controller import Controller
from mrpipe.control.kernel import COMMAND_SIZE
from mrpipe.control.laws import law_named
from mrpipe.dampers.drive import command_place, lag_step, polynomial_step
from mrpipe.dampers.hysteresis import hysteresis_step
from mrpipe.dampers.plant import Chain, build_chain, new_state, sum_step
from mrpipe.errors import DivergedError, UserError
from mrpipe.signals.discretisation import discretise_first_order
from mrpipe.simulation import kernel, parts
from mrpipe.simulation.checks import check_loop
from mrpipe.simulation.clock import Clock, clock_of
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.sensors import SensorFault, SensorNoise, add_fault, sensor_noise
from mrpipe.simulation.settings import SimulateSettings
from mrpipe.structures import Frame, state_space

Tracking = Literal["damper", "ideal", "continuous", "unclipped"]


RECORD_RATE_HZ = 1000.0
"""Default rate of the histories [Hz]. With a perfect damper, whose force jumps, it is the rate of the plant."""

_SETTINGS = SimulateSettings()
"""The defaults that the options share with the settings."""


@dataclass(frozen=True)
class LoopOptions:
    """Options of the simulation of the loop.

    Attributes
    ----------
    plant_rate_hz
        Steps of the plant per second; raised to the next multiple of the rate of the controller.
    tracking
        `damper`: the chain gives the force. `ideal`: the damper gives the clipped desired force of the controller and
        holds it from sample to sample. `continuous`: the law acts on the true motion at every instant, and its force
        is clipped where it would add energy. Only vd, vdps and vdns can do this, because the other laws have a memory
        (docs/numerics.md). `unclipped`: as `continuous` without clipping. The loop is then linear, so that it can be
        compared with the exact frequency response.
    delay_s
        Time from sampling to output of the controller.
    driver_time_constant_s
        Lag of the current driver in addition to that of the damper's model; 0: none.
    noise
        Noise of the sensors.
    record_rate_hz
        Rate of the histories in the response.
    fault
        Fault of the sensors; None: there is none.
    """

    plant_rate_hz: float = _SETTINGS.plant_rate_hz
    tracking: Tracking = _SETTINGS.tracking
    delay_s: float = _SETTINGS.controller.delay_s
    driver_time_constant_s: float = _SETTINGS.driver_time_constant_s
    noise: SensorNoise = field(default_factory=SensorNoise)
    record_rate_hz: float = RECORD_RATE_HZ
    fault: SensorFault | None = None


@dataclass(frozen=True)
class Response:
    """Response of the loop; every history has shape (m,) or (m, n), in SI units, on the clock `time_s`.

    Attributes
    ----------
    time_s
        Clock of the histories.
    displacement, velocity, acceleration
        Histories of the floors relative to the ground, shape (m, n).
    absolute_acceleration
        Absolute acceleration of the floors, shape (m, n).
    damper_displacement, damper_velocity
        Across the damper.
    force, drive, desired_force
        Damper force [N], drive at the damper [A or V], force desired by the controller [N].
    ground_acceleration
        Acceleration of the base.
    base_shear
        r' M times the absolute accelerations, shape (m,): the force of structure and dampers on the ground [N].
    work_in, work_damper, work_frame, energy
        Work of the base, dissipated by damper and frame, and energy stored in the frame [J] since the start.
    commands
        Commands of the controller, shape (samples, COMMAND_SIZE); see :mod:`mrpipe.control.kernel`.
    command_time_s
        Clock of the controller.
    seconds
        Wall time of the compiled loop [s].
    floors
        Columns of the degrees of freedom that move with the ground: the first floor to the top. Empty: all columns.
    others
        Responses of the other dampers of the same run, where a largest value counts all dampers.
    """

    time_s: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    absolute_acceleration: FloatArray
    damper_displacement: FloatArray
    damper_velocity: FloatArray
    force: FloatArray
    drive: FloatArray
    desired_force: FloatArray
    ground_acceleration: FloatArray
    base_shear: FloatArray
    work_in: FloatArray
    work_damper: FloatArray
    work_frame: FloatArray
    energy: FloatArray
    commands: FloatArray
    command_time_s: FloatArray
    seconds: float
    floors: tuple[int, ...] = ()
    others: tuple[Response, ...] = ()

    @property
    def columns(self) -> list[int]:
        """Columns of the floors, the first floor to the top."""
        return list(self.floors) or list(range(self.displacement.shape[1]))

    @property
    def top(self) -> int:
        """Column of the top floor."""
        return self.columns[-1]

    @property
    def energy_balance_error(self) -> float:
        """Largest error of the energy balance, relative to the energy that was stored or dissipated [1]."""
        missing = self.energy[0] + self.work_in - self.work_damper - self.work_frame - self.energy
        turned_over = float(np.max(self.energy) + np.max(np.abs(self.work_damper)) + self.work_frame[-1])
        return float(np.max(np.abs(missing))) / turned_over if turned_over > 0.0 else 0.0

    @property
    def real_time_factor(self) -> float:
        """Simulated over wall time."""
        return float(self.time_s[-1]) / max(self.seconds, 1e-9)


def base_shear(frame: Frame, absolute_acceleration: FloatArray) -> FloatArray:
    """Return the force of structure and dampers on the ground [N], shape (m,).

    Parameters
    ----------
    frame
        Gives the masses.
    absolute_acceleration
        Absolute acceleration of the degrees of freedom [m/s^2], shape (m, n).
    """
    # BLAS is not used, because its second thread continues to run after a product of this length
    return np.asarray(np.einsum("tf,f->t", absolute_acceleration, frame.ground_masses))


def no_damper() -> Chain:
    """Return a chain whose force is zero."""
    return build_chain([])


def is_plain(chain: Chain) -> bool:
    """Return whether a chain is the plain one of (2.1) to (2.4), whose parameters the compiled loop reads directly.

    The step names are not sufficient, because a lag with different rates for rising and falling drive has the same
    name.
    """
    return chain.names == parts.BOUC_WEN and chain.functions[:4] == (
        lag_step, polynomial_step, hysteresis_step, sum_step
    )  # fmt: skip


def simulate_law(
    frame: Frame,
    chain: Chain | None,
    controller: Controller,
    excitation: Excitation,
    options: LoopOptions | None = None,
    *,
    position: FloatArray | None = None,
    rng: np.random.Generator | None = None,
    initial_state: FloatArray | None = None,
) -> Response:
    """Run the loop of Figure 5.3.

    Parameters
    ----------
    frame
        Structure.
    chain
        Damper, with its effects; None with `tracking="ideal"`.
    controller
        Controller that was made by :func:`~mrpipe.control.controller.build_controller`.
    excitation
        Base acceleration; its duration is that of the run.
    options
        Options of the simulation of the loop.
    position
        Connectivity vector w, shape (n,); floor 1 to ground if left out.
    rng
        Generator of the sensor noise; needed where there is some.
    initial_state
        [x, v] of the floors at the start, shape (2n,); rest if left out.

    Raises
    ------
    UserError
        If the mass is singular, the delay negative, or there is neither a damper nor perfect tracking.
    DivergedError
        If the response grows without bound.
    """
    options = options or LoopOptions()
    check_loop(frame, options)
    n = frame.floors
    w = _position(frame, position)
    if chain is None and options.tracking == "damper":
        raise UserError("simulate", "damper", "there is none", "give a damper or tracking: ideal")
    chain = chain or no_damper()
    rate = controller.options.rate_hz
    clock = clock_of(excitation.duration_s, rate, options.plant_rate_hz, options.record_rate_hz)
    dt, samples = clock.dt, clock.samples
    chain.check_interval(dt)
    ground = clock.ground(excitation)
    counts, run = _run_numbers(controller, options, clock)
    counts[parts.I_COMMAND] = command_place(chain)
    if options.tracking == "damper" and is_plain(chain):
        counts[parts.I_TRACK] = parts.TRACK_BOUC_WEN
    commands = np.zeros((samples, COMMAND_SIZE))
    record = np.zeros((clock.records, 3 * n + parts.T_SIZE))
    z = np.zeros(2 * n) if initial_state is None else np.array(initial_state, dtype=np.float64)
    noise = sensor_noise(options.noise, samples, n, rng)
    if options.fault is not None:
        add_fault(noise, options.fault, rng)
    matrices = [np.ascontiguousarray(item) for item in (frame.mass, frame.damping, frame.stiffness, w)]
    plant = _plant(frame, w, dt)
    memory = controller.new_state()
    began = time.perf_counter()
    kernel.run_loop(
        counts, run, *plant, *matrices, ground, z, *chain.arguments, new_state(chain),
        *controller.arguments, memory, noise, commands, record,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    if not np.all(np.isfinite(record)):
        raise DivergedError(f"law {controller.law}: the response grows without bound; lower the negative stiffness")
    return _response(record, commands, w, frame, dt * clock.every, dt * clock.per_sample, seconds)


def _plant(frame: Frame, w: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return step matrix, contribution of the force at the end, lower half of A, and gain of the force."""
    n = frame.floors
    space = state_space(frame, -w)
    Ad, B0, B1 = discretise_first_order(space.A, space.B, dt)
    relative = w @ space.A[n:]
    # rows below the state: displacement, velocity and acceleration of the damper, and the sum 1'M x
    outputs = np.zeros((2 * n + 4, 2 * n))
    outputs[: 2 * n] = np.eye(2 * n)
    outputs[2 * n, :n] = w
    outputs[2 * n + 1, n:] = w
    outputs[2 * n + 2] = relative
    outputs[2 * n + 3, :n] = frame.ground_masses
    step_matrix = outputs @ np.column_stack([Ad, B0[:, 0], B1[:, 0], B0[:, 1]])
    step_matrix[2 * n + 2, 2 * n + 1] += w @ space.B[n:, 0]
    at_end = outputs @ B1[:, 1]
    at_end[2 * n + 2] += w @ space.B[n:, 1]
    parts = (step_matrix.T, at_end, space.A[n:].T, space.B[n:, 1])
    first, second, third, fourth = (np.ascontiguousarray(part) for part in parts)
    return first, second, third, fourth


def _position(frame: Frame, position: FloatArray | None) -> FloatArray:
    n = frame.floors
    if position is None:
        position = np.eye(n)[0]
    w = np.asarray(position, dtype=np.float64)
    if w.shape != (n,):
        raise UserError("simulate", "position", f"has {w.size} entries", f"the frame has {n} floors")
    return w


def _run_numbers(
    controller: Controller, options: LoopOptions, clock: Clock
) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.int64]], FloatArray]:
    track = parts.TRACK_DAMPER
    if options.tracking == "ideal":
        if law_named(controller.law).output == "drive":
            raise UserError(
                "simulate",
                "tracking",
                f"law {controller.law} commands the drive, so that a perfect damper has no force to give",
                "set tracking: damper",
            )
        track = parts.TRACK_SAMPLED
    elif options.tracking in ("continuous", "unclipped"):
        if not law_named(controller.law).linear:
            raise UserError(
                "simulate", "tracking", f"law {controller.law} cannot run in continuous time", "give ideal or damper"
            )
        track = parts.TRACK_LAW
    counts = np.zeros(parts.I_SIZE, dtype=np.int64)
    counts[parts.I_STEPS], counts[parts.I_PER_SAMPLE], counts[parts.I_RECORD] = (
        clock.steps,
        clock.per_sample,
        clock.every,
    )
    counts[parts.I_DELAY] = round(options.delay_s / clock.dt)
    counts[parts.I_TRACK] = track
    run = np.zeros(parts.R_SIZE)
    run[parts.R_DT] = clock.dt
    lag = options.driver_time_constant_s
    run[parts.R_LAG] = 1.0 if lag <= 0.0 else -math.expm1(-clock.dt / lag)
    run[parts.R_C], run[parts.R_K] = controller.gains.c_n_s_m, controller.gains.k_n_m
    run[parts.R_CLIPPED] = 0.0 if options.tracking == "unclipped" else 1.0
    return counts, run


def _response(
    record: FloatArray,
    commands: FloatArray,
    w: FloatArray,
    frame: Frame,
    dt: float,
    command_dt: float,
    seconds: float,
) -> Response:
    n = len(w)
    tail = record[:, 3 * n :]
    ground = tail[:, parts.T_GROUND]
    absolute = record[:, 2 * n : 3 * n]
    return Response(
        time_s=dt * np.arange(len(record), dtype=np.float64),
        displacement=record[:, :n],
        velocity=record[:, n : 2 * n],
        acceleration=absolute - np.outer(ground, frame.ground_influence),
        absolute_acceleration=absolute,
        # BLAS is not used, because its second thread continues to run after a product of this length
        damper_displacement=np.einsum("tf,f->t", record[:, :n], w),
        damper_velocity=np.einsum("tf,f->t", record[:, n : 2 * n], w),
        force=tail[:, parts.T_FORCE],
        drive=tail[:, parts.T_DRIVE],
        desired_force=tail[:, parts.T_DESIRED],
        ground_acceleration=ground,
        base_shear=base_shear(frame, absolute),
        work_in=tail[:, parts.T_WORK_IN],
        work_damper=tail[:, parts.T_WORK_DAMPER],
        work_frame=tail[:, parts.T_WORK_FRAME],
        energy=tail[:, parts.T_ENERGY],
        commands=commands,
        command_time_s=command_dt * np.arange(len(commands), dtype=np.float64),
        seconds=seconds,
        floors=frame.moved_by_ground,
    )
