"""Sensors of the loop: their noise, and faulty readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.kernel import (
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
    MEASURED_VELOCITY,
)
from mrpipe.simulation.settings import SensorFaultSettings

_FAULT = SensorFaultSettings()
"""The defaults that the options share with the settings."""


@dataclass(frozen=True)
class SensorNoise:
    """RMS noise of a sample of each sensor, and constant bias of the accelerometers.

    Attributes
    ----------
    displacement_m
        Noise of the displacement sensor at the damper [m].
    acceleration_m_s2
        Noise of each accelerometer [m/s^2].
    acceleration_bias_m_s2
        Bias of the difference of the two accelerometers that give the acceleration of the damper [m/s^2].
    """

    displacement_m: float = 0.0
    acceleration_m_s2: float = 0.0
    acceleration_bias_m_s2: float = 0.0


MISSING, ZERO, STUCK = float("nan"), float("-inf"), float("inf")
"""Mark in the noise of a sensor for a reading that is missing, zero, or the one before."""


@dataclass(frozen=True)
class SensorFault:
    """Faulty readings.

    Attributes
    ----------
    mark
        :data:`MISSING`, :data:`ZERO` or :data:`STUCK`.
    sensor
        `displacement`, `accelerometers`, `velocity`, `force` or `all`.
    share
        Share of the samples that begin a fault [1].
    samples
        Length of a fault.
    """

    mark: float
    sensor: str = _FAULT.sensor
    share: float = _FAULT.share
    samples: int = _FAULT.samples


def sensor_noise(noise: SensorNoise, samples: int, floors: int, rng: np.random.Generator | None) -> FloatArray:
    """Return sensor noise, shape (samples, 5 + n); the acceleration of the damper is the difference of two sensors."""
    result = np.zeros((samples, MEASURED_FLOORS + floors))
    if noise.displacement_m > 0.0 or noise.acceleration_m_s2 > 0.0:
        if rng is None:
            raise ValueError("sensor noise needs a generator")
        result[:, MEASURED_DISPLACEMENT] = noise.displacement_m * rng.standard_normal(samples)
        accelerations = noise.acceleration_m_s2 * rng.standard_normal((samples, 1 + floors))
        result[:, MEASURED_GROUND], result[:, MEASURED_FLOORS:] = accelerations[:, 0], accelerations[:, 1:]
        result[:, MEASURED_ACCELERATION] = noise.acceleration_m_s2 * rng.standard_normal(samples)
    result[:, MEASURED_ACCELERATION] += noise.acceleration_bias_m_s2
    return result


def add_fault(noise: FloatArray, fault: SensorFault, rng: np.random.Generator | None) -> None:
    """Mark the faulty readings in the noise; the first sample is good."""
    if rng is None:
        raise ValueError("a sensor fault needs a generator")
    begins = np.flatnonzero(rng.random(len(noise)) < fault.share)
    faulty = np.zeros(len(noise), dtype=bool)
    for begin in begins:
        faulty[max(begin, 1) : begin + fault.samples] = True
    channels = {
        "displacement": [MEASURED_DISPLACEMENT],
        "velocity": [MEASURED_VELOCITY],
        "force": [MEASURED_FORCE],
        "accelerometers": [MEASURED_ACCELERATION, MEASURED_GROUND, *range(MEASURED_FLOORS, noise.shape[1])],
        "all": list(range(noise.shape[1])),
    }[fault.sensor]
    noise[np.ix_(faulty, channels)] = fault.mark
