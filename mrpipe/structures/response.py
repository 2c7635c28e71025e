"""Response of a linear frame to a recorded excitation, by exact steps in its complex modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import floor_position, state_space
from mrpipe.structures.frame import Frame


@dataclass(frozen=True)
class LinearResponse:
    """Response histories, shape (m, n).

    Attributes
    ----------
    displacement, velocity
        Displacement and velocity relative to the ground [m], [m/s].
    absolute_acceleration
        Absolute acceleration [m/s^2].
    """

    displacement: FloatArray
    velocity: FloatArray
    absolute_acceleration: FloatArray


_STEPS_IN_A_PERIOD = 33.0
"""Steps in a period of the highest frequency; straight lines between them are 0.3 % too small at this frequency."""
_MOST_VALUES = 4e7
"""Largest number of values of a simulated history."""


def band_limited_response(
    frame: Frame,
    excitation: FloatArray,
    dt: float,
    highest_hz: float,
    *,
    shaker_floor: int = 0,
    force_position: FloatArray | None = None,
) -> LinearResponse:
    """Return the response from rest to an excitation that has no frequencies above half the sampling rate.

    A measured excitation is such a signal. A straight line between its samples is too small by the factor
    sinc^2(f dt), which is 0.81 at a quarter of the sampling rate. The excitation is therefore interpolated with a
    low-pass filter to shorter steps before the simulation.

    Parameters
    ----------
    frame, excitation, dt, shaker_floor, force_position
        As for :func:`linear_response`.
    highest_hz
        Highest frequency of interest [Hz]; there the remaining error is 0.3 %.
    """
    most = max(1, int(_MOST_VALUES / max(excitation.size * 2 * frame.floors, 1)))
    parts = min(max(1, int(np.ceil(_STEPS_IN_A_PERIOD * highest_hz * dt))), most)
    fine = excitation if parts == 1 else signal.resample_poly(excitation, parts, 1)
    found = linear_response(frame, fine, dt / parts, shaker_floor=shaker_floor, force_position=force_position)
    histories = (found.displacement, found.velocity, found.absolute_acceleration)
    return LinearResponse(*(item[::parts] for item in histories))


def linear_response(
    frame: Frame,
    excitation: FloatArray,
    dt: float,
    *,
    shaker_floor: int = 0,
    force_position: FloatArray | None = None,
    initial_state: FloatArray | None = None,
) -> LinearResponse:
    """Return the response to an excitation that is linear between samples, exact to rounding.

    Parameters
    ----------
    frame
        The structure.
    excitation
        Ground acceleration [m/s2], or force [N] on `shaker_floor` or at `force_position`; shape (m,).
    dt
        Sampling interval [s].
    shaker_floor
        Number of the floor on which the force acts, from 1; 0: ground motion.
    force_position
        Shape (n,): share of a unit force on each degree of freedom, instead of `shaker_floor`.
    initial_state
        State [x, v] at the first sample, shape (2n,); None: at rest.
    """
    n = frame.floors
    if force_position is None and shaker_floor:
        force_position = floor_position(n, shaker_floor)
    column = 0 if force_position is None else 1
    space = state_space(frame, force_position)
    load = space.B[:, column]
    poles, vectors = np.linalg.eig(space.A)
    entry = np.linalg.solve(vectors, load.astype(np.complex128))
    z0 = np.zeros(2 * n) if initial_state is None else np.asarray(initial_state, dtype=np.float64)
    start = np.linalg.solve(vectors, z0.astype(np.complex128))
    state = np.zeros((excitation.size, 2 * n))
    upper = poles.imag >= 0.0
    for pole, shape, gain, first in zip(poles[upper], vectors.T[upper], entry[upper], start[upper], strict=True):
        step = np.exp(pole * dt)
        # integrals of a constant and of a ramp over one step
        constant = (step - 1.0) / pole if abs(pole) * dt > 1e-8 else dt + 0j
        ramp = (constant - dt) / (pole * dt) if abs(pole) * dt > 1e-5 else dt / 2.0 + 0j
        driven = gain * ((constant - ramp) * excitation[:-1] + ramp * excitation[1:])
        forcing = np.concatenate([[first], driven])
        coordinate = signal.lfilter([1.0], [1.0, -step], forcing)
        twice = 2.0 if pole.imag > 0.0 else 1.0
        state += twice * np.real(np.outer(coordinate, shape))
    C, D = space.absolute_acceleration()
    direct = D[:, column]
    acceleration = state @ C.T + np.outer(excitation, direct)
    return LinearResponse(state[:, :n], state[:, n:], acceleration)
