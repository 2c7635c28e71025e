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
