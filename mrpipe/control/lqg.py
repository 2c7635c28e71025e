"""Linear-quadratic control with a Kalman observer; the damper clips it (thesis appendix E, errata row 18)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError

from mrpipe.artifacts import FloatArray
from mrpipe.control.calibration_settings import RegulatorSettings
from mrpipe.control.riccati import predictor_gain, regulator_gain
from mrpipe.control.settings import ControllerSettings
from mrpipe.errors import UserError
from mrpipe.signals.discretisation import discretise_zero_order
from mrpipe.structures import Frame, state_space


@dataclass(frozen=True)
class Observer:
    """Observer z+ = F z + g f + H y with the desired force -k z and the force f of the damper.

    The measurements are y = [damper displacement, ground acceleration, floor accelerations].

    Attributes
    ----------
    transition, force_input, innovation, gain
        F (2n, 2n), g (2n,), H (2n, n + 2), k (2n,) for n floors.
    sample_time_s
        Sampling interval for which the observer was computed [s].
    floors
        Number of floors n.
    """

    transition: FloatArray
    force_input: FloatArray
    innovation: FloatArray
    gain: FloatArray
    sample_time_s: float
    floors: int


_REGULATOR, _CONTROLLER = RegulatorSettings(), ControllerSettings()
"""Sources of the defaults, so that weights and settings have the same ones."""


@dataclass(frozen=True)
class Weights:
    """Weights of LQG and the noise that it assumes.

    Attributes
    ----------
    energy
        Weight of kinetic and strain energy [1/J].
    top_displacement
        Weight of the top floor's displacement squared [1/m^2].
    force
        Weight of the damper force squared [1/N^2].
    ground_noise_m_s2
        Noise of the measured ground acceleration, including model error, which excites the state [m/s^2].
    force_noise_n
        Error of the force that the observer holds over a sample, taken as noise [N]. The measured force changes within
        the sample; a desired force also differs from that of the damper, by at least the residual force.
    displacement_noise_m, acceleration_noise_m_s2
        RMS noise of the sensors [m], [m/s^2].
    """

    energy: float = _REGULATOR.energy_weight
    top_displacement: float = _REGULATOR.top_displacement_weight
    force: float = 1e-4
    ground_noise_m_s2: float = _REGULATOR.ground_noise_m_s2
    force_noise_n: float = 20.0
    displacement_noise_m: float = _CONTROLLER.kalman_displacement_noise_m
    acceleration_noise_m_s2: float = _CONTROLLER.kalman_acceleration_noise_m_s2


def state_weight(frame: Frame, weights: Weights) -> FloatArray:
    """Return the weight Q, shape (2n, 2n), of the state z = [x, v], from energy and top displacement."""
    n = frame.floors
    Q = np.zeros((2 * n, 2 * n))
    Q[:n, :n] = 0.5 * weights.energy * (frame.stiffness + frame.stiffness.T)
    Q[n:, n:] = weights.energy * frame.mass
    Q[frame.top, frame.top] += weights.top_displacement
    return Q


def frame_regulator_gain(frame: Frame, position: FloatArray, weights: Weights) -> FloatArray:
    """Return k, shape (2n,), of the continuous regulator u = -k z with u the force on the structure along `position`.

    u = -R^-1 B' P z, with one minus sign (errata row 18).

    Raises
    ------
    UserError
        If the Riccati equation has no solution (singular mass, or weights that leave a mode free).
    """
    if np.linalg.matrix_rank(frame.mass) < frame.floors:
        raise UserError(f"frame {frame.name}", "mass", "is singular", "every floor needs a positive mass")
    space = state_space(frame, position)
    try:
        gain = regulator_gain(space.A, space.B[:, 1:], state_weight(frame, weights), np.array([[weights.force]]))
    except (LinAlgError, ValueError) as error:
        raise UserError("control law", "lqg", f"no regulator ({error})", "give positive weights") from error
    return np.asarray(gain[0])


def frame_observer_gain(frame: Frame, position: FloatArray, weights: Weights, dt: float) -> FloatArray:
    """Return the steady gain L (2n, n + 1) of the discrete Kalman predictor on [damper displacement, accelerations].

    The noise of the accelerometer of the ground excites the state. The accelerometers of the floors have independent
    noise. Amplitudes of modes, as after a Craig-Bampton reduction, have no accelerometer; their columns are zero.
    """
    Ad, Bd, C, D = _sampled(frame, position, dt)
    W = weights.ground_noise_m_s2**2 * np.outer(Bd[:, 0], Bd[:, 0])
    W += weights.force_noise_n**2 * np.outer(Bd[:, 1], Bd[:, 1])
    # a small noise on every velocity keeps the gain of the observer above zero in modes that the ground hardly excites
    n = frame.floors
    W[n:, n:] += (0.05 * weights.ground_noise_m_s2 * dt) ** 2 * np.eye(n)
    V = np.diag([weights.displacement_noise_m**2] + [weights.acceleration_noise_m_s2**2] * n)
    # an accelerometer on the floor of the damper measures the force without delay
    V += weights.force_noise_n**2 * np.diag(D[:, 1] ** 2)
    read = 1 + n - frame.modal_coordinates
    L = np.zeros((2 * n, n + 1))
    L[:, :read] = predictor_gain(Ad, np.ascontiguousarray(C[:read]), W, V[:read, :read])
    return L


def _sampled(frame: Frame, position: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return Ad, Bd (inputs: ground acceleration, damper force), C, D of the sampled plant."""
    space = state_space(frame, -np.asarray(position))
    Ad, Bd = discretise_zero_order(space.A, space.B, dt)
    acceleration_C, acceleration_D = space.absolute_acceleration()
    n = frame.floors
    C = np.vstack([np.concatenate([position, np.zeros(n)]), acceleration_C])
    D = np.vstack([np.zeros(space.B.shape[1]), acceleration_D])
    return Ad, Bd, C, D


def lqg_observer(frame: Frame, position: FloatArray, weights: Weights, dt: float) -> Observer:
    """Return the sampled observer and its regulator for :func:`~mrpipe.control.controller.build_controller`.

    The observer predicts from the measured ground acceleration and the measured force of the damper, or the desired
    one, and corrects with the damper displacement and the floors' absolute accelerations. The desired damper force,
    positive where it resists as in (4.1), is minus the force on the structure that the regulator demands.
    """
    Ad, Bd, C, D = _sampled(frame, position, dt)
    L = frame_observer_gain(frame, position, weights, dt)
    n = frame.floors
    H = np.zeros((2 * n, n + 2))
    H[:, 0] = L[:, 0]
    H[:, 1] = Bd[:, 0] - L @ D[:, 0]
    H[:, 2:] = L[:, 1:]
    return Observer(
        transition=Ad - L @ C,
        force_input=Bd[:, 1] - L @ D[:, 1],
        innovation=H,
        gain=-frame_regulator_gain(frame, position, weights),
        sample_time_s=dt,
        floors=n,
    )
