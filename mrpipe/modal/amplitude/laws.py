"""Modes whose frequency and damping depend on the amplitude of the motion.

Slip in joints and slight yielding of materials cause natural frequencies of real structures to fall and damping ratios
to grow with amplitude. No single linear model then fits a record with large amplitudes well. Here each mode keeps its
shape, and follows

    omega(A) = omega_0 (1 + A/A_0)^(-a),    zeta(A) = zeta_0 (1 + A/A_0)^b,

where A is the amplitude (envelope) of the displacement: that of the mode itself or that of the whole motion. For small
A both laws are linear in A, for large A linear in its logarithm on a logarithmic scale.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.records import FrameTest, Place, Sensor
from mrpipe.structures.over_amplitude import modes_at_amplitude

Measure = Literal["constant", "mode", "motion"]

_INITIAL_PERIODS = 3.0


@dataclass(frozen=True)
class AmplitudeLaws:
    """Frequency and damping of r modes over amplitude.

    Attributes
    ----------
    measure
        Amplitude in the laws: that of the `mode` itself, that of the whole `motion`, or none (`constant`).
    angular_frequencies, damping_ratios
        Shape (r,): values at zero amplitude [rad/s], [1].
    softening, damping_growth
        Shape (r,): exponents a and b [1].
    references_m
        Shape (r,): reference amplitudes A_0 [m].
    """

    measure: Measure
    angular_frequencies: FloatArray
    damping_ratios: FloatArray
    softening: FloatArray
    damping_growth: FloatArray
    references_m: FloatArray

    def at(self, amplitude_m: float | FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return angular frequencies [rad/s] and damping ratios [1], each of shape (r,).

        Parameters
        ----------
        amplitude_m
            Amplitude [m]: one for all modes, or shape (r,).
        """
        return modes_at_amplitude(
            self.angular_frequencies,
            self.damping_ratios,
            self.softening,
            self.damping_growth,
            amplitude_m / self.references_m,
        )

    def rows(self) -> FloatArray:
        """Return the laws in the layout of the simulation, shape (r, 5)."""
        columns = (
            self.angular_frequencies,
            self.damping_ratios,
            self.softening,
            self.damping_growth,
            self.references_m,
        )
        return np.ascontiguousarray(np.column_stack(columns))


@dataclass(frozen=True)
class AmplitudeModel:
    """Amplitude-dependent modes with their shapes.

    Attributes
    ----------
    laws
        Frequency and damping of each mode.
    sensors, inputs
        Rows of `shapes` and `direct`; columns of `direct` and rows of `gains`.
    gains
        Shape (k, r): force over modal mass for a unit input [m/s2 per unit].
    shapes
        Shape (s, r): motion of a sensor for a unit motion of the mode; about 1 at the sensor that moves most.
    direct
        Shape (s, k): response of modes above the band to each input.
    largest_m
        Shape (r,): largest amplitude that counts for each mode in the records of the fit [m]; beyond it the laws are
        extrapolated.
    smallest_m
        Shape (r,): amplitude below which the records hold 5 % of the energy of each mode [m]; below it the laws are
        extrapolated.
    """

    laws: AmplitudeLaws
    sensors: tuple[Sensor, ...]
    inputs: tuple[Place, ...]
    gains: FloatArray
    shapes: FloatArray
    direct: FloatArray
    largest_m: FloatArray
    smallest_m: FloatArray

    def response(self, test: FrameTest) -> FloatArray:
        """Return the simulated response of each sensor of a test, shape (m, s) [m/s2] or [m].

        The motion at the first sample is estimated from the first periods of the test. Columns of sensors that the
        model does not have are zero.
        """
        inputs = input_columns(test, self.inputs)
        initial = initial_state(self.laws, self.shapes, self.direct, test, inputs, inputs @ self.gains, self.sensors)
        found = simulated(self.laws, inputs @ self.gains, 1.0 / test.sampling_rate_hz, initial)
        return at_sensors(self.shapes, self.direct, test, inputs, found, self.sensors)


def input_columns(test: FrameTest, inputs: Sequence[Place]) -> FloatArray:
    """Return the inputs of a test without their means, shape (m, k); zero for inputs that it does not have."""
    known = test.inputs
    zeros = np.zeros(test.responses.shape[0])
    return np.column_stack([known[place] - known[place].mean() if place in known else zeros for place in inputs])


@dataclass(frozen=True)
class Motion:
    """Displacement and acceleration of each mode, (m, r), and the amplitude of the whole motion, (m,)."""

    displacement: FloatArray
    acceleration: FloatArray
    amplitude: FloatArray


def simulated(laws: AmplitudeLaws, forces: FloatArray, dt: float, initial: FloatArray | None = None) -> Motion:
    """Return the motion of modes under forces over modal mass, shape (m, r) [m/s2].

    Parameters
    ----------
    laws
        Frequency and damping over amplitude.
    forces
        Shape (m, r).
    dt
        Sampling interval [s].
    initial
        Displacement [m] and velocity [m/s] at the first sample, shape (r, 2); at rest if left out.
    """
    from mrpipe.modal.amplitude.kernel import simulate_modes

    forces = np.ascontiguousarray(forces)
    start = np.zeros((forces.shape[1], 2)) if initial is None else np.ascontiguousarray(initial)
    displacement, acceleration = np.empty_like(forces), np.empty_like(forces)
    amplitude = np.empty(forces.shape[0])
    simulate_modes(forces, dt, laws.rows(), laws.measure == "motion", start, displacement, acceleration, amplitude)
    return Motion(displacement, acceleration, amplitude)


def at_sensors(
    shapes: FloatArray,
    direct: FloatArray,
    test: FrameTest,
    inputs: FloatArray,
    motion: Motion,
    sensors: Sequence[Sensor],
) -> FloatArray:
    """Return the motion at the sensors of a test, shape (m, s)."""
    result = np.zeros((inputs.shape[0], len(test.sensors)))
    for column, sensor in enumerate(test.sensors):
        if sensor in sensors:
            row = sensors.index(sensor)
            modes = motion.displacement if sensor.is_displacement else motion.acceleration
            result[:, column] = modes @ shapes[row] + inputs @ direct[row]
    return result


def initial_state(
    laws: AmplitudeLaws,
    shapes: FloatArray,
    direct: FloatArray,
    test: FrameTest,
    inputs: FloatArray,
    forces: FloatArray,
    sensors: Sequence[Sensor],
) -> FloatArray:
    """Return displacement [m] and velocity [m/s] of each mode at the first sample, shape (r, 2).

    Least squares over the first periods of the lowest mode, with the frequencies and damping of small amplitudes.
    """
    modes = forces.shape[1]
    dt = 1.0 / test.sampling_rate_hz
    count = int(_INITIAL_PERIODS * 2.0 * np.pi / float(laws.angular_frequencies.min()) / dt)
    count = min(max(count, 4 * modes), inputs.shape[0])
    constant = replace(laws, softening=np.zeros(modes), damping_growth=np.zeros(modes))
    scale = np.column_stack([np.ones(modes), laws.angular_frequencies])

    def seen(part: FloatArray, inputs_part: FloatArray, initial: FloatArray) -> FloatArray:
        motion = simulated(constant, part, dt, initial)
        return at_sensors(shapes, direct, test, inputs_part, motion, sensors).ravel()

    known = [sensor in sensors for sensor in test.sensors]
    target = test.responses[:count] - test.responses.mean(axis=0)
    size = np.maximum(np.std(test.responses, axis=0), 1e-300)
    weight = np.tile(np.where(known, 1.0 / size, 0.0), count)
    rest = target.ravel() - seen(forces[:count], inputs[:count], np.zeros((modes, 2)))
    columns = []
    for index in range(2 * modes):
        unit = np.zeros((modes, 2))
        unit[index // 2, index % 2] = scale[index // 2, index % 2]
        columns.append(seen(np.zeros((count, modes)), np.zeros_like(inputs[:count]), unit))
    values = np.linalg.lstsq(np.column_stack(columns) * weight[:, None], rest * weight, rcond=1e-8)[0]
    return np.asarray(values.reshape(modes, 2) * scale)
