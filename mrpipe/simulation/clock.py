"""Time steps of a loop: of the plant, of the controller, and of the recorded histories."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.simulation.excitation import Excitation


@dataclass(frozen=True)
class Clock:
    """Time steps of a run.

    Attributes
    ----------
    dt
        Step of the plant [s].
    steps
        Number of steps.
    per_sample
        Number of steps per sample of the controller.
    every
        Number of steps from one recorded value to the next.
    """

    dt: float
    steps: int
    per_sample: int
    every: int

    @property
    def samples(self) -> int:
        """Number of samples of the controller."""
        return self.steps // self.per_sample + 1

    @property
    def records(self) -> int:
        """Number of recorded values."""
        return self.steps // self.every + 1

    def ground(self, excitation: Excitation) -> FloatArray:
        """Return the base acceleration at the ends of the steps [m/s^2], shape (steps + 1,)."""
        return np.ascontiguousarray(excitation.at(self.dt * np.arange(self.steps + 1, dtype=np.float64)))

    def inputs(self, excitation: Excitation) -> FloatArray:
        """Return the inputs at the ends of the steps, shape (steps + 1, m): base acceleration, then those of `places`.

        An excitation that does not shake the base has zeros there.
        """
        histories = self.ground(excitation)
        if not excitation.places:
            return histories[:, None]
        ground = np.zeros((len(histories), 0 if excitation.shakes_ground else 1))
        return np.ascontiguousarray(np.column_stack([ground, histories]))


def clock_of(duration_s: float, rate_hz: float, plant_rate_hz: float, record_rate_hz: float) -> Clock:
    """Return the time steps of a run.

    Parameters
    ----------
    duration_s
        Length of the run [s].
    rate_hz
        Rate of the controller; the step of the plant divides its sample.
    plant_rate_hz
        Least rate of the plant.
    record_rate_hz
        Rate of the histories.
    """
    per_sample = max(1, math.ceil(plant_rate_hz / rate_hz - 1e-9))
    dt = 1.0 / (rate_hz * per_sample)
    return Clock(dt, max(1, round(duration_s / dt)), per_sample, max(1, round(1.0 / (dt * record_rate_hz))))
