"""Arrays of a controller: its parts, packed in the order in which :mod:`mrpipe.control.kernel` reads them."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import butter

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control import kernel
from mrpipe.control.controller_options import DYNAMIC_RANGE, ControllerOptions
from mrpipe.control.inverse import InverseTable
from mrpipe.control.kalman import discrete_kalman_gains
from mrpipe.control.law import Law
from mrpipe.control.lqg import Observer
from mrpipe.errors import UserError
from mrpipe.networks.network import Network

_SOURCES = {
    "kalman": kernel.VELOCITY_KALMAN,
    "measured": kernel.VELOCITY_MEASURED,
    "difference": kernel.VELOCITY_DIFFERENCE,
}
_CHANNELS = {"displacement": 0, "velocity": 1, "acceleration": 2, "force": 3}

_LARGEST_FORCE_N = 1e9
"""Largest plausible reading of a force sensor [N], where the options give none."""


class ControllerArrays:
    """Arrays of a controller, to which its parts are appended.

    Attributes
    ----------
    options
        Options of the controller.
    numbers
        Blocks of the array of numbers, in their order.
    layout
        Indices at which the blocks begin, and their sizes, as :mod:`mrpipe.control.kernel` reads them.
    """

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

    def add_table(self, table: InverseTable) -> None:
        """Add an inverse table."""
        self.layout[kernel.INVERSE] = kernel.INVERSE_TABLE
        self.layout[kernel.AT_TABLE] = self.at
        self.layout[kernel.TABLE_SPEEDS], self.layout[kernel.TABLE_DRIVES] = table.forces.shape
        self.numbers[0][kernel.TABLE_SPEED] = table.largest_speed_m_s
        self.numbers[0][kernel.TABLE_DRIVE] = table.largest_drive
        self.numbers.append(np.ravel(table.forces))

    def add_network(self, network: Network, slot: int, spacing_slot: int) -> int:
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

    def add_observer(self, observer: Observer) -> int:
        """Add an observer and return the number of floors that it reads."""
        if abs(observer.sample_time_s * self.options.rate_hz - 1.0) > 1e-9:
            raise UserError("control law", "observer", "was made for another rate", "calibrate at this rate")
        self.layout[kernel.AT_OBSERVER] = self.at
        for part in (observer.transition, observer.force_input, observer.innovation, observer.gain):
            self.numbers.append(np.ravel(part))
        return observer.floors

    def finish(self, law: Law, history: int, floors: int) -> tuple[FloatArray, IntArray]:
        """Add the limits of the readings and the places of the state, and return the numbers and the layout.

        Parameters
        ----------
        law
            The law of the controller.
        history
            Number of past samples that its networks read.
        floors
            Number of floors whose accelerometers it reads.
        """
        observed = 2 * floors if "observer" in law.needs else 0
        limits = _largest_readings(self.options, law, floors)
        layout = self.layout
        layout[kernel.OBSERVER_FORCE] = int(_observer_reads_force(self.options, law))
        layout[kernel.AT_LIMITS], layout[kernel.CHANNELS] = self.at, len(limits)
        self.numbers.append(limits)
        layout[kernel.FLOORS] = floors
        layout[kernel.STATE_HISTORY] = kernel.S_HEAD
        layout[kernel.HISTORY] = history
        layout[kernel.STATE_OBSERVER] = kernel.S_HEAD + 4 * history
        layout[kernel.STATE_LAW] = kernel.S_HEAD + 4 * history + observed
        layout[kernel.STATE_GOOD] = kernel.S_HEAD + 4 * history + observed + law.memory
        layout[kernel.STATE_SIZE] = layout[kernel.STATE_GOOD] + len(limits)
        numbers = np.ascontiguousarray(np.concatenate(self.numbers), dtype=np.float64)
        return numbers, np.concatenate([layout, *self.networks]).astype(np.int64)


def _observer_reads_force(options: ControllerOptions, law: Law) -> bool:
    """Return whether the observer of the law takes the measured force of the damper in place of the desired one."""
    return "observer-force" in law.needs and options.observer_force == "measured"


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
    if "damper-force" in law.needs or _observer_reads_force(options, law):
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
