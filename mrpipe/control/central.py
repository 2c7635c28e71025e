"""One regulator and one observer for several dampers, with any set of sensors (LQG, thesis appendix E)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg import LinAlgError

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.kernel import LAW_SIGNATURE, S_REQUEST
from mrpipe.control.law import Law
from mrpipe.control.lqg import Weights, state_weight
from mrpipe.control.riccati import predictor_gain, regulator_gain
from mrpipe.errors import UserError
from mrpipe.signals.discretisation import discretise_zero_order
from mrpipe.structures import Frame, state_space

MODEL_NOISE_SHARE = 0.05
"""Ratio of the noise on the velocity of every degree of freedom to that of the ground. It keeps the gain of the
observer above zero in modes that the ground hardly excites.
"""


@dataclass(frozen=True)
class Sensors:
    """Sensors that the observer reads in addition to the ground acceleration.

    Attributes
    ----------
    accelerometers
        Indices (from 0) of the degrees of freedom with an accelerometer.
    dampers
        Indices (from 0) of the dampers of the regulator whose displacement is measured.
    """

    accelerometers: tuple[int, ...]
    dampers: tuple[int, ...]


@dataclass(frozen=True)
class CentralRegulator:
    """Regulator z+ = F z + G f + H y with the desired forces -K z and the forces f of the dampers.

    The measurements are y = [ground acceleration, displacements of the dampers, floor accelerations].

    Attributes
    ----------
    transition, force_input, innovation, gain
        F (2n, 2n), G (2n, k), H (2n, 1 + p), K (k, 2n) for n degrees of freedom, k dampers, and p sensors in addition
        to the ground acceleration.
    sensors
        Sensors. The order of their readings after the ground acceleration is: displacements of the dampers, then
        accelerometers.
    sample_time_s
        Sampling interval for which the regulator was computed [s].
    """

    transition: FloatArray
    force_input: FloatArray
    innovation: FloatArray
    gain: FloatArray
    sensors: Sensors
    sample_time_s: float


def central_regulator(
    frame: Frame,
    positions: FloatArray,
    weights: Sequence[Weights],
    sensors: Sensors,
    dt: float,
    *,
    flexibilities: Sequence[float] | None = None,
) -> CentralRegulator:
    """Return the sampled LQG regulator of several dampers.

    The dampers resist with forces f, so that M x'' + C x' + K x = -W f - M r x_g''. The weights of energy and of the
    top displacement, and the noise, are those of the first damper; each damper has its own weight of the force.

    A damper behind a brace measures the displacement of its rod, w'x - f/k_b. For f the observer takes the measured
    force of the damper, or the desired one (`observer_force` of :class:`~mrpipe.control.settings.ControllerSettings`).

    Parameters
    ----------
    frame
        Structure, including the linear equivalents of the other dampers.
    positions
        Connectivity matrix W of the dampers, shape (n, k).
    weights
        Weights of each damper.
    sensors
        Sensors that the observer reads.
    dt
        Sampling interval [s].
    flexibilities
        1/k_b of the brace of each damper [m/N]; None: rigid braces.

    Raises
    ------
    UserError
        If there is no sensor, or a Riccati equation has no solution.
    """
    n, k = positions.shape
    if not sensors.accelerometers and not sensors.dampers:
        raise UserError(
            "structure", "accelerometers", "lqg has no sensor", "give accelerometers or damper displacements"
        )
    first = weights[0]
    space = state_space(frame, -positions)
    Ad, Bd = discretise_zero_order(space.A, space.B, dt)
    acceleration_C, acceleration_D = space.absolute_acceleration()
    rows = list(sensors.accelerometers)
    C = np.vstack([np.hstack([positions.T[list(sensors.dampers)], np.zeros((len(sensors.dampers), n))]),
                   acceleration_C[rows]])  # fmt: skip
    by_braces = np.zeros((k, 1 + k))
    by_braces[:, 1:] = -np.diag(np.zeros(k) if flexibilities is None else flexibilities)
    D = np.vstack([by_braces[list(sensors.dampers)], acceleration_D[rows]])
    force_noise = np.array([item.force_noise_n for item in weights])
    W = first.ground_noise_m_s2**2 * np.outer(Bd[:, 0], Bd[:, 0])
    W += Bd[:, 1:] @ np.diag(force_noise**2) @ Bd[:, 1:].T
    W[n:, n:] += (MODEL_NOISE_SHARE * first.ground_noise_m_s2 * dt) ** 2 * np.eye(n)
    V = np.diag([first.displacement_noise_m**2] * len(sensors.dampers) + [first.acceleration_noise_m_s2**2] * len(rows))
    # an accelerometer next to a damper, and a rod behind a brace, show the error of the force at once
    V += np.diag(np.sum((D[:, 1:] * force_noise) ** 2, axis=1))
    try:
        R = np.diag([item.force for item in weights])
        # the columns of B hold the sign of a resisting force, so that u = -K z is the force of the dampers
        gain = regulator_gain(space.A, space.B[:, 1:], state_weight(frame, first), R)
        L = predictor_gain(Ad, C, W, V)
    except (LinAlgError, ValueError) as error:
        raise UserError(
            "control law", "lqg", f"no regulator ({error})", "give positive weights, or more sensors"
        ) from error
    return CentralRegulator(
        transition=Ad - L @ C,
        force_input=Bd[:, 1:] - L @ D[:, 1:],
        innovation=np.column_stack([Bd[:, 0] - L @ D[:, 0], L]),
        gain=np.asarray(gain),
        sensors=sensors,
        sample_time_s=dt,
    )


@njit(LAW_SIGNATURE, cache=True)
def requested_force(numbers: FloatArray, layout: IntArray, state: FloatArray, measured: FloatArray) -> float:  # noqa: ARG001
    """Return the force [N] that the central regulator requests from this damper."""
    return state[S_REQUEST]


CENTRAL = Law(
    name="lqg",
    summary="linear-quadratic regulator of several dampers",
    source="thesis appendix E",
    force=requested_force,
    c_body="    return state[S_REQUEST];\n",
    needs=frozenset({"observer-force"}),
)
"""The law of one damper under a central regulator, which writes the desired force into the controller's state."""
