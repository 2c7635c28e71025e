"""A frame as a subject of exports: its exact discrete step, test vectors and plain description."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.exports.contract import Channel, Subject, Vectors
from mrpipe.signals.discretisation import discretise_zero_order
from mrpipe.structures.dynamics import natural_modes, state_space
from mrpipe.structures.frame import Frame

ROWS = 400
RATE_HZ = 1000.0


@dataclass(frozen=True)
class DiscreteFrame:
    """A frame with its exact step for inputs that are constant over a sample.

    Attributes
    ----------
    frame
        The structure.
    position
        Connectivity vector w of the damper, shape (n,) [1].
    sample_time_s
        Interval of the steps.
    transition, input
        Shapes (2n, 2n) and (2n, 2): z+ = transition z + input u with the state z = [displacement, velocity] relative
        to the ground and u = [ground acceleration, damper force].
    acceleration_of_state, acceleration_of_input
        Shapes (n, 2n) and (n, 2): absolute accelerations of the floors.
    """

    frame: Frame
    position: FloatArray
    sample_time_s: float
    transition: FloatArray
    input: FloatArray
    acceleration_of_state: FloatArray
    acceleration_of_input: FloatArray


def frame_subject(
    frame: Frame,
    position: FloatArray,
    name: str = "frame",
    prefix: str = "mrpipe",
    rate_hz: float = RATE_HZ,
    **details: Any,
) -> Subject:
    """Return a frame with a damper force at `position` (shape (n,)) and test vectors of its response."""
    # the force of a damper that resists acts against w (4.1)
    continuous = state_space(frame, -np.asarray(position, dtype=np.float64)[:, None])
    transition, given = discretise_zero_order(continuous.A, continuous.B, 1.0 / rate_hz)
    of_state, of_input = continuous.absolute_acceleration()
    discrete = DiscreteFrame(frame, np.asarray(position), 1.0 / rate_hz, transition, given, of_state, of_input)
    return Subject("frame", name, f"{prefix}_{name}", discrete, frame_vectors(discrete), details)


def frame_vectors(discrete: DiscreteFrame) -> Vectors:
    """Return a ground acceleration that sweeps over the modes, a damper force, and the response of the floors."""
    n = discrete.frame.floors
    time = discrete.sample_time_s * np.arange(ROWS)
    frequencies = natural_modes(discrete.frame).angular_frequencies
    ground = np.sin(frequencies[0] * time * (1.0 + 2.0 * time / time[-1]))
    weight = float(np.trace(discrete.frame.mass))
    force = 0.2 * weight * np.sin(1.7 * frequencies[0] * time)
    states = np.zeros((ROWS, 2 * n))
    accelerations = np.zeros((ROWS, n))
    state = np.zeros(2 * n)
    for row, given in enumerate(np.column_stack([ground, force])):
        states[row] = state
        accelerations[row] = discrete.acceleration_of_state @ state + discrete.acceleration_of_input @ given
        state = discrete.transition @ state + discrete.input @ given
    names = [name.replace(" ", "_") for name in discrete.frame.names]
    outputs = [Channel(f"displacement_{name}", "m", states[:, place]) for place, name in enumerate(names)]
    outputs += [Channel(f"velocity_{name}", "m/s", states[:, n + place]) for place, name in enumerate(names)]
    outputs += [Channel(f"acceleration_{name}", "m/s^2", accelerations[:, place]) for place, name in enumerate(names)]
    return Vectors(
        (Channel("ground_acceleration", "m/s^2", ground), Channel("damper_force", "N", force)),
        tuple(outputs),
        discrete.sample_time_s,
        single_limit=1e-2,
    )


def described(discrete: DiscreteFrame) -> dict[str, Any]:
    """Return the frame as plain values."""
    frame = discrete.frame
    return {
        "equation": "M x'' + C x' + K x = -w f - M r x_g'', x relative to the ground",
        "degrees_of_freedom": list(frame.names),
        "mass_kg": frame.mass.tolist(),
        "damping_n_s_m": frame.damping.tolist(),
        "stiffness_n_m": frame.stiffness.tolist(),
        "influence": frame.ground_influence.tolist(),
        "position_of_damper": discrete.position.tolist(),
        "frequencies_hz": natural_modes(frame).frequencies_hz.tolist(),
        "sample_time_s": discrete.sample_time_s,
        "transition": discrete.transition.tolist(),
        "input": discrete.input.tolist(),
        "acceleration_of_state": discrete.acceleration_of_state.tolist(),
        "acceleration_of_input": discrete.acceleration_of_input.tolist(),
    }
