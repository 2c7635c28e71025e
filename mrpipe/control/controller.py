"""Construction of a controller as plain arrays, which :func:`mrpipe.control.kernel.controller_step` runs.

The closed loop, the virtual laboratory, the tracing of effects and the C export use the same arrays::

    controller = build_controller("fdns", Gains(alpha_n_m=3000.0), ControllerOptions(rate_hz=200.0), inverse=network)
    state = controller.new_state()
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from scipy.signal import butter

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control import kernel
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import InverseTable
from mrpipe.control.kalman import discrete_kalman_gains
from mrpipe.control.law import Law
from mrpipe.control.laws import law_named
from mrpipe.control.lqg import Observer
from mrpipe.control.settings import ControllerSettings
from mrpipe.errors import UserError
from mrpipe.networks.network import Network

_SOURCES = {
    "kalman": kernel.VELOCITY_KALMAN,
    "measured": kernel.VELOCITY_MEASURED,
    "difference": kernel.VELOCITY_DIFFERENCE,
}
_CHANNELS = {"displacement": 0, "velocity": 1, "acceleration": 2, "force": 3}


DYNAMIC_RANGE = 1e5
"""Largest reading of a sensor over its noise, where the settings give none: 100 dB, more than 16 bits can hold."""

_LARGEST_FORCE_N = 1e9


_SETTINGS = ControllerSettings()
"""Source of the defaults, so that options and settings have the same ones."""


@dataclass(frozen=True)
class ControllerOptions:
    """Options of the controller.

    Attributes
    ----------
    rate_hz
        Sampling rate [Hz] (200 and 500 in the thesis).
    velocity
        `kalman` (5.1 to 5.3), `measured` (a perfect velocity sensor) or `difference` (backward difference).
    displacement_noise_m, acceleration_noise_m_s2
        RMS noise that the Kalman filter assumes.
    bias_drift_m_s2
        Drift of the bias of the accelerometer per second that the filter follows [m/s^2]; 0: no bias state.
    inverse_request
        Past values of an inverse network. `steady`: the present values, so that the network gives the drive that would
        hold this force at this speed. `history`: the forces that were desired before. A network was trained on measured
        forces, which build up over the yield displacement after a reversal, whereas a desired force jumps at a
        reversal.
    residual_force_n
        Switch P2 (24): below this desired force [N] the drive is 0; 0: no switch.
    low_pass_hz
        Cut-off of the second-order Butterworth low-pass on the drive [Hz]; None: no low-pass.
    drive_limit
        Largest drive [A or V]; None: that of the inverse or of the damper.
    dead_band_m_s
        Speed below which the direction of motion is kept [m/s].
    friction_rounding_m_s
        Speed v0 over which the friction of fdns changes its sign, tanh(v/v0) [m/s]; 0: the jump of (4.18), with which
        the noise of the velocity makes the force chatter.
    extremum_step_m, extremum_share
        Distance by which the displacement must return from an extremum before it counts: in metres, or as share of the
        amplitude.
    extremum_memory_s
        Time after which a pending extremum is confirmed even if the displacement does not return [s]; three quarters of
        a period is suitable.

    largest_displacement_m, largest_velocity_m_s, largest_acceleration_m_s2, largest_force_n
        Largest plausible readings; larger ones and those that are not finite are refused. None: what a sensor of
        :data:`DYNAMIC_RANGE` can read.
    saturation_force_n
        Largest force of the damper [N]; None: not known.
    fault_hold_s
        Time [s] for which a refused reading is replaced by the last good one before the drive is set to `safe_drive`.
    safe_drive
        Drive while the readings cannot be used [A or V].
    """

    rate_hz: float = 200.0
    velocity: Literal["kalman", "measured", "difference"] = _SETTINGS.velocity
    displacement_noise_m: float = _SETTINGS.kalman_displacement_noise_m
    acceleration_noise_m_s2: float = _SETTINGS.kalman_acceleration_noise_m_s2
    bias_drift_m_s2: float = _SETTINGS.kalman_bias_drift_m_s2
    inverse_request: Literal["steady", "history"] = _SETTINGS.inverse_request
    residual_force_n: float = 0.0
    low_pass_hz: float | None = _SETTINGS.low_pass_hz
    drive_limit: float | None = None
    dead_band_m_s: float = _SETTINGS.dead_band_m_s
    friction_rounding_m_s: float = 0.0
    extremum_step_m: float = 1e-4
    extremum_share: float = _SETTINGS.extremum_share
    extremum_memory_s: float = 0.6
    largest_displacement_m: float | None = None
    largest_velocity_m_s: float | None = None
    largest_acceleration_m_s2: float | None = None
    largest_force_n: float | None = None
    saturation_force_n: float | None = None
    fault_hold_s: float = _SETTINGS.fault_hold_s
    safe_drive: float = _SETTINGS.safe_drive


@dataclass(frozen=True)
class Controller:
    """Controller as a compiled force and plain arrays.

    Attributes
    ----------
    law
        Name of its law.
    force
        Compiled force of the law.
    numbers, layout
        Arrays for :func:`~mrpipe.control.kernel.controller_step`.
    gains, options
        Gains and options from which it was built.
    floors
        Number of floors whose accelerometers it reads; 0: it reads none.
    networks
        Networks `inverse` and `law`, if present, in the form in which they are evaluated.
    details
        Further facts about the controller, for tables and JSON.
    """

    law: str
    force: Any
    numbers: FloatArray
    layout: IntArray
    gains: Gains
    options: ControllerOptions
    floors: int = 0
    networks: Mapping[str, Network] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def arguments(self) -> tuple[Any, FloatArray, IntArray]:
        """Return (force, numbers, layout), the first arguments of :func:`~mrpipe.control.kernel.controller_step`."""
        return self.force, self.numbers, self.layout

    @property
    def sample_time_s(self) -> float:
        """Interval between calls [s]."""
        return 1.0 / self.options.rate_hz

    @property
    def state_size(self) -> int:
        """Length of its state array."""
        return int(self.layout[kernel.STATE_SIZE])

    @property
    def measured_size(self) -> int:
        """Smallest length of the array of measurements."""
        return kernel.MEASURED_FLOORS + self.floors

    def new_state(self) -> FloatArray:
        """Return a state array of zeros for the first call."""
        return np.zeros(self.state_size)


def build_controller(
    law: str | Law,
    gains: Gains,
    options: ControllerOptions,
    *,
    inverse: Network | InverseTable | None = None,
    reference: Network | None = None,
    observer: Observer | None = None,
    position: FloatArray | None = None,
) -> Controller:
    """Return the controller of a law, packed into arrays.

    Parameters
    ----------
    law
        A law or its name.
    gains
        Gains of the law.
    options
        Options of the controller.
    inverse
        Inverse from desired force to drive: a network as P2 (23), or a table; None: a damper that tracks the desired
        force perfectly.
    reference
        Network from displacement and velocity to force (4.3.4), for a law that needs one.
    observer
        Observer, for a law that needs one.
    position
        Connectivity vector w of the damper, shape (n,), for a law that reads the accelerometers of the floors.

    Raises
    ------
    UserError
        If the law is unknown, if its gains, network or observer are missing, or if the cut-off of the low-pass is above
        half the sampling rate.
    """
    entry = law_named(law) if isinstance(law, str) else law
    _check_parts(entry, gains, reference, observer, position)
    pack = _Pack(options)
    pack.layout[kernel.OUTPUT] = kernel.OUTPUT_DRIVE if entry.output == "drive" else kernel.OUTPUT_FORCE
    pack.numbers[0][kernel.GAIN_C : kernel.GAIN_ALPHA + 1] = [gains.c_n_s_m, gains.k_n_m, gains.alpha_n_m]
    limit = options.drive_limit
    history = 2
    networks: dict[str, Network] = {}
    if isinstance(inverse, InverseTable):
        pack.table(inverse)
        limit = inverse.largest_drive if limit is None else limit
    elif inverse is not None:
        # its own past output is refused by the pack, in words
        plain = options.inverse_request == "history" or inverse.features.past_target
        asked = inverse if plain else inverse.steady()
        history = max(history, pack.network(asked, kernel.NETWORK_INVERSE, kernel.INVERSE_SPACING))
        pack.layout[kernel.INVERSE] = kernel.INVERSE_NETWORK
        if entry.output == "force":
            networks["inverse"] = asked
    if reference is not None and "network" in entry.needs:
        networks["law"] = reference
        history = max(history, pack.network(reference, kernel.NETWORK_LAW, kernel.LAW_SPACING))
    floors = 0
    if observer is not None and "observer" in entry.needs:
        floors = pack.observer(observer)
    elif position is not None and "floor-accelerations" in entry.needs:
        floors = len(position)
    pack.numbers[0][kernel.DRIVE_LIMIT] = 1e300 if limit is None else limit
    if limit is None and "drive-limit" in entry.needs:
        raise UserError("control law", entry.name, "has no drive limit", "give the largest drive of the damper")
    pack.layout[kernel.AT_LAW] = pack.at
    pack.numbers.append(entry.numbers(gains, position, 1.0 / options.rate_hz))
    return pack.finish(entry, gains, history, floors, networks)


def _check_parts(
    law: Law, gains: Gains, reference: Network | None, observer: Observer | None, position: FloatArray | None
) -> None:
    if "network" in law.needs and reference is None:
        raise UserError("control law", law.name, "has no trained network", "calibrate it first")
    if "observer" in law.needs and observer is None:
        raise UserError("control law", law.name, "has no observer", "calibrate it first")
    if "floor-accelerations" in law.needs and observer is None and position is None:
        raise UserError("control law", law.name, "does not know where the damper is", "give its position")
    required = [gain.name for gain in law.gains if not gain.optional]
    if required and "network" not in law.needs and not any(gains.get(name, 0.0) for name in required):
        raise UserError("control law", law.name, "has no gains", "calibrate it first or give them")


class _Pack:
    """Appends the parts of a controller to its arrays."""

    def __init__(self, options: ControllerOptions) -> None:
        self.options = options
        head = np.zeros(kernel.HEAD)
        dt = 1.0 / options.rate_hz
        head[kernel.SAMPLE_TIME] = dt
        head[kernel.RESIDUAL_FORCE] = options.residual_force_n
        head[kernel.KALMAN : kernel.KALMAN + 3] = discrete_kalman_gains(
            options.displacement_noise_m, options.acceleration_noise_m_s2, dt, options.bias_drift_m_s2
        )
        head[kernel.DEAD_BAND] = options.dead_band_m_s
        head[kernel.ROUNDING] = options.friction_rounding_m_s
        head[kernel.EXTREMUM_STEP] = options.extremum_step_m
        head[kernel.EXTREMUM_SHARE] = options.extremum_share
        head[kernel.MEMORY] = options.extremum_memory_s
        head[kernel.LOW_PASS : kernel.LOW_PASS + 5] = _low_pass(options)
        self.numbers = [head]
        self.layout = np.zeros(kernel.LAYOUT_SIZE, dtype=np.int64)
        self.layout[kernel.VELOCITY_SOURCE] = _SOURCES[options.velocity]
        self.networks: list[IntArray] = []
        head[kernel.SAFE_DRIVE] = options.safe_drive
        head[kernel.LARGEST_FORCE] = 1e300 if options.saturation_force_n is None else options.saturation_force_n
        # a time that is a whole number of samples must not lose one to rounding
        self.layout[kernel.HOLD] = math.floor(options.fault_hold_s * options.rate_hz + 1e-6)

    @property
    def at(self) -> int:
        """Index at which the next block of numbers begins."""
        return sum(len(block) for block in self.numbers)

    def table(self, table: InverseTable) -> None:
        """Add an inverse table."""
        self.layout[kernel.INVERSE] = kernel.INVERSE_TABLE
        self.layout[kernel.AT_TABLE] = self.at
        self.layout[kernel.TABLE_SPEEDS], self.layout[kernel.TABLE_DRIVES] = table.forces.shape
        self.numbers[0][kernel.TABLE_SPEED] = table.largest_speed_m_s
        self.numbers[0][kernel.TABLE_DRIVE] = table.largest_drive
        self.numbers.append(np.ravel(table.forces))

    def network(self, network: Network, slot: int, spacing_slot: int) -> int:
        """Add a network and return the length of the histories that it needs."""
        spec = network.features
        unknown = [name for name in spec.channels if name not in _CHANNELS]
        if unknown or spec.past_target or len(spec.channels) > 4:
            wrong = unknown[0] if unknown else "its own past output"
            raise UserError("network", "inputs", f"{wrong} cannot be an input in the loop", "use motion and force")
        if max(network.layers) > kernel.WIDEST:
            raise UserError("network", "neurons", f"a layer has {max(network.layers)}", f"at most {kernel.WIDEST}")
        if len(network.layers) > kernel.NET_SIZE - kernel.NET_NEURONS:
            raise UserError("network", "layers", f"there are {len(network.layers)}", "at most 7 with input and output")
        entry = np.zeros(kernel.NET_SIZE, dtype=np.int64)
        entry[kernel.NET_AT] = self.at
        entry[kernel.NET_LAYERS] = len(network.weights)
        entry[kernel.NET_PAST] = spec.past_values
        entry[kernel.NET_CHANNELS] = len(spec.channels)
        entry[kernel.NET_ABSOLUTE] = int(spec.absolute)
        for index, name in enumerate(spec.channels):
            entry[kernel.NET_CODES + index] = _CHANNELS[name]
        entry[kernel.NET_NEURONS : kernel.NET_NEURONS + len(network.layers)] = network.layers
        self.layout[slot] = kernel.LAYOUT_SIZE + kernel.NET_SIZE * len(self.networks)
        self.networks.append(entry)
        spacing = self.options.rate_hz / spec.sampling_rate_hz
        self.numbers[0][spacing_slot] = spacing
        self.numbers.append(np.concatenate([network.input_scale, network.input_shift]))
        self.numbers.append(np.array([network.output_scale, network.output_shift]))
        for matrix, bias in zip(network.weights, network.biases, strict=True):
            self.numbers.append(np.concatenate([np.ravel(matrix), bias]))
        return int(np.ceil(spec.past_values * spacing)) + 2

    def observer(self, observer: Observer) -> int:
        """Add an observer and return the number of floors that it reads."""
        if abs(observer.sample_time_s * self.options.rate_hz - 1.0) > 1e-9:
            raise UserError("control law", "observer", "was made for another rate", "calibrate at this rate")
        self.layout[kernel.AT_OBSERVER] = self.at
        for part in (observer.transition, observer.force_input, observer.innovation, observer.gain):
            self.numbers.append(np.ravel(part))
        return observer.floors

    def finish(self, law: Law, gains: Gains, history: int, floors: int, networks: Mapping[str, Network]) -> Controller:
        """Return the controller."""
        observed = 2 * floors if "observer" in law.needs else 0
        limits = _largest_readings(self.options, law, floors)
        layout = self.layout
        layout[kernel.AT_LIMITS], layout[kernel.CHANNELS] = self.at, len(limits)
        self.numbers.append(limits)
        layout[kernel.FLOORS] = floors
        layout[kernel.STATE_HISTORY] = kernel.S_HEAD
        layout[kernel.HISTORY] = history
        layout[kernel.STATE_OBSERVER] = kernel.S_HEAD + 4 * history
        layout[kernel.STATE_LAW] = kernel.S_HEAD + 4 * history + observed
        layout[kernel.STATE_GOOD] = kernel.S_HEAD + 4 * history + observed + law.memory
        layout[kernel.STATE_SIZE] = layout[kernel.STATE_GOOD] + len(limits)
        return Controller(
            law=law.name,
            force=law.force,
            numbers=np.ascontiguousarray(np.concatenate(self.numbers), dtype=np.float64),
            layout=np.concatenate([layout, *self.networks]).astype(np.int64),
            gains=gains,
            options=self.options,
            floors=floors,
            networks=networks,
        )


def _largest_readings(options: ControllerOptions, law: Law, floors: int) -> FloatArray:
    """Return the largest plausible reading of each measurement, shape (5 + floors,); 0 for those that are not read."""
    noise = options.displacement_noise_m, options.acceleration_noise_m_s2
    # a motion whose displacement and acceleration fill the range of their sensors has this velocity
    motion = (noise[0], math.sqrt(noise[0] * noise[1]), noise[1])
    given = options.largest_displacement_m, options.largest_velocity_m_s, options.largest_acceleration_m_s2
    x, v, a = (DYNAMIC_RANGE * scale if limit is None else limit for scale, limit in zip(motion, given, strict=True))
    if min(x, v, a) <= 0.0 or (options.largest_force_n or 1.0) <= 0.0:
        raise UserError("controller", "largest_...", "is not positive", "give the largest plausible reading")
    limits = np.zeros(kernel.MEASURED_FLOORS + floors)
    limits[kernel.MEASURED_DISPLACEMENT], limits[kernel.MEASURED_ACCELERATION] = x, a
    if options.velocity == "measured":
        limits[kernel.MEASURED_VELOCITY] = v
    if "floor-accelerations" in law.needs:
        limits[kernel.MEASURED_GROUND] = limits[kernel.MEASURED_FLOORS :] = a
    if "damper-force" in law.needs:
        limits[kernel.MEASURED_FORCE] = options.largest_force_n or _LARGEST_FORCE_N
    return limits


def _low_pass(options: ControllerOptions) -> FloatArray:
    """Return the coefficients b0, b1, b2, a1, a2 of the Butterworth low-pass at the rate of the controller."""
    if options.low_pass_hz is None:
        return np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    if options.low_pass_hz >= 0.5 * options.rate_hz:
        raise UserError(
            "controller",
            "low_pass_hz",
            f"{options.low_pass_hz:g} Hz is not below half of {options.rate_hz:g} Hz",
            "lower it or leave the filter out with null",
        )
    b, a = butter(2, options.low_pass_hz, fs=options.rate_hz)
    return np.array([b[0], b[1], b[2], a[1], a[2]])
