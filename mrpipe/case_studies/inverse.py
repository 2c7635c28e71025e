"""The neural inverse of the large Bingham damper (6.1): |v|, |f| to volts, trained on four kinds of motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.run import BinghamDevice
from mrpipe.networks.assembly import History
from mrpipe.networks.evaluation import error_figures
from mrpipe.networks.network import FeatureSpec, Network
from mrpipe.networks.options import TrainingOptions
from mrpipe.networks.training import Trained, train

KINDS = ("sine", "triangle", "step", "gaussian")
"""Displacement inputs of the training set (6.1)."""
RATE_HZ = 200.0
"""Sampling of the training records; the inverse has no memory, so it can be used at any rate."""
_RECORD_S = 4.0
FREQUENCY_HZ = 3.0
"""Frequency of the motion and the command of Figure 6.1."""
AMPLITUDE_M = 0.1
"""Amplitude of the motion of Figure 6.1."""
_COMMAND_V = 5.0
_CYCLES = 3


@dataclass(frozen=True)
class ValidatedInverse:
    """A neural inverse, its error on held-out records, and its estimate in the validation of Figure 6.1 (b).

    The thesis gives a displacement of 0.1 m and a command with an amplitude of 5, both at 3 Hz. The command of this
    damper cannot be negative, so the magnitude of the sine is used.

    Attributes
    ----------
    network
        The inverse: |v|, |f| to volts.
    held_out_nrmse
        Error on the records that the training did not use, divided by the RMS of their voltage.
    time_s, voltage_v, estimate_v
        The validation: time, the voltage that gave the force, and the voltage that the network estimates, shape (n,).
    """

    network: Network
    held_out_nrmse: float
    time_s: FloatArray
    voltage_v: FloatArray
    estimate_v: FloatArray

    @property
    def nrmse(self) -> float:
        """Return the RMS error of the validation divided by the RMS of the voltage."""
        return error_figures(self.voltage_v, self.estimate_v).nrmse


def bingham_force(device: BinghamDevice, velocity: FloatArray, voltage: FloatArray) -> FloatArray:
    """Return the force [N] of P4 (6), of the shape of `velocity` [m/s] and `voltage` [V]."""
    yielding = device.force + device.force_per_volt * voltage
    viscosity = device.viscosity + device.viscosity_per_volt * voltage
    return np.asarray(yielding * np.sign(velocity) + viscosity * velocity)


def _band_limited(rng: np.random.Generator, time: FloatArray, highest_hz: float) -> FloatArray:
    """Return Gaussian noise of unit size below `highest_hz`."""
    spectrum = np.fft.rfft(rng.standard_normal(len(time)))
    frequencies = np.fft.rfftfreq(len(time), float(time[1] - time[0]))
    signal = np.fft.irfft(np.where(frequencies <= highest_hz, spectrum, 0.0), len(time))
    return np.asarray(signal / np.abs(signal).max())


def _velocity(kind: str, rng: np.random.Generator, time: FloatArray, peak: float) -> FloatArray:
    frequency = rng.uniform(0.3, 3.0)
    phase = 2.0 * np.pi * (frequency * time + rng.uniform())
    if kind == "sine":
        return np.asarray(peak * np.cos(phase))
    if kind == "triangle":
        return np.asarray(peak * np.sign(np.cos(phase)))
    if kind == "step":
        # a displacement step through the lag of an actuator: the velocity decays
        return np.asarray(peak * np.sign(np.cos(phase)) * np.exp(-4.0 * np.mod(frequency * time, 0.5) / frequency))
    return peak * _band_limited(rng, time, 3.0)


def _voltage(kind: str, rng: np.random.Generator, time: FloatArray, highest: float) -> FloatArray:
    if kind == "step":
        levels = rng.uniform(0.0, highest, 8)
        return np.asarray(levels[np.minimum((time / _RECORD_S * 8).astype(int), 7)])
    if kind == "gaussian":
        return np.asarray(0.5 * highest * (1.0 + _band_limited(rng, time, 4.0)))
    return np.asarray(0.5 * highest * (1.0 - np.cos(2.0 * np.pi * rng.uniform(0.3, 3.0) * time)))


def training_history(
    device: BinghamDevice, rng: np.random.Generator, *, fastest_m_s: float = 2.0, records: int = 6
) -> History:
    """Return records of all combinations of motion and drive kinds.

    Parameters
    ----------
    device
        The damper.
    rng
        Generator of the frequencies, phases and noise.
    fastest_m_s
        Highest velocity [m/s].
    records
        Number of records of each kind of motion.
    """
    time: FloatArray = np.arange(round(_RECORD_S * RATE_HZ), dtype=np.float64) / RATE_HZ
    names, velocities, volts = [], [], []
    for kind in KINDS:
        for number in range(records):
            drive = KINDS[number % len(KINDS)]
            names.append(f"{kind}-{drive}-{number}")
            velocities.append(_velocity(kind, rng, time, fastest_m_s * rng.uniform(0.1, 1.0)))
            volts.append(_voltage(drive, rng, time, device.highest_voltage))
    velocity, voltage = np.concatenate(velocities), np.concatenate(volts)
    force = bingham_force(device, velocity, voltage)
    zeros = np.zeros_like(velocity)
    channels = {"displacement": zeros, "velocity": velocity, "acceleration": zeros, "drive": voltage, "force": force}
    starts = np.arange(len(names) + 1, dtype=np.int64) * len(time)
    return History(tuple(names), channels, starts, tuple(True for _ in names), RATE_HZ, "V")


def train_inverse(device: BinghamDevice, rng: np.random.Generator, *, hidden: int = 6, jobs: int = 1) -> Trained:
    """Train the inverse network of |v| and |f|, two hidden layers.

    Parameters
    ----------
    device
        The damper.
    rng
        Generator of the records, the starts and the split.
    hidden
        Neurons of each hidden layer.
    jobs
        Threads.
    """
    spec = FeatureSpec(("velocity", "force"), 0, True, RATE_HZ, "drive")
    options = TrainingOptions(
        architecture=(hidden, hidden),
        biases=True,
        starts=4,
        refined_starts=1,
        subsample_rows=4000,
        subsample_iterations=120,
        iterations=40,
    )
    return train(training_history(device, rng), spec, options, rng, jobs=jobs)


def neural_inverse(
    device: BinghamDevice, rng: np.random.Generator, *, hidden: int = 6, jobs: int = 1
) -> ValidatedInverse:
    """Train the inverse network and validate it; see :func:`train_inverse` for the parameters."""
    return validated_inverse(device, train_inverse(device, rng, hidden=hidden, jobs=jobs))


def validated_inverse(device: BinghamDevice, trained: Trained) -> ValidatedInverse:
    """Return the validation of Figure 6.1 (b) for a trained inverse.

    Parameters
    ----------
    device
        The damper that the network inverts.
    trained
        Result of `train_inverse`.
    """
    angular_frequency = 2.0 * np.pi * FREQUENCY_HZ
    time: FloatArray = np.arange(round(_CYCLES / FREQUENCY_HZ * 1000.0), dtype=np.float64) / 1000.0
    velocity = AMPLITUDE_M * angular_frequency * np.cos(angular_frequency * time)
    # a phase between motion and command, so that the command is not zero at each reversal
    voltage = _COMMAND_V * np.abs(np.sin(angular_frequency * time + 0.5))
    force = bingham_force(device, velocity, voltage)
    estimate = trained.network.predict(np.stack([np.abs(velocity), np.abs(force)], axis=1))
    return ValidatedInverse(trained.network, trained.starts[0].held_out_nrmse, time, voltage, np.asarray(estimate))
