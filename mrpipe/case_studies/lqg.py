"""LQG of appendix E with corrected signs (errata row 18): Riccati gains, Kalman-Bucy observer, and its sampled form.

The thesis writes u = -K x with K = -R^-1 (B'P + S'), a double negative that makes the loop unstable; B for B-bar in
(E.7); and leaves a transpose out of (E.10). Here u = -K x with K = R^-1 (B'P + S').
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.riccati import kalman_bucy_gain, regulator_gain
from mrpipe.signals.discretisation import discretise_zero_order


@dataclass(frozen=True)
class Outputs:
    """y = C x + D u + F w.

    Attributes
    ----------
    C, D, F
        Shapes (p, n), (p, k), (p, m).
    """

    C: FloatArray
    D: FloatArray
    F: FloatArray


@dataclass(frozen=True)
class SampledController:
    """The LQG controller at equal samples, in terms of resisting device forces f = -u.

    With measurement y and the force f now acting:  f_wanted = feedback xh;  xh+ = step xh - step_force f + gain y.
    The plant measures y = measure z - measure_force f + noise.

    Attributes
    ----------
    step, step_force, gain, feedback
        Shapes (n, n), (n, k), (n, p), (k, n).
    measure, measure_force
        Shapes (p, nz), (p, k), of the plant's state.
    interval_s
        Sampling interval of the controller [s].
    """

    step: FloatArray
    step_force: FloatArray
    gain: FloatArray
    feedback: FloatArray
    measure: FloatArray
    measure_force: FloatArray
    interval_s: float


def output_regulator_gain(A: FloatArray, B: FloatArray, regulated: Outputs, Q: FloatArray, R: FloatArray) -> FloatArray:
    """Return K, shape (k, n), for the cost z'Qz + u'R u with z = Cz x + Dz u (E.4): the lqry of (E.6) and (E.7).

    Parameters
    ----------
    A, B
        The plant.
    regulated
        Cz, Dz (Fz plays no part).
    Q, R
        Weights of outputs (p, p) and forces (k, k).
    """
    C, D = regulated.C, regulated.D
    Qbar = C.T @ Q @ C
    Rbar = D.T @ Q @ D + R
    return regulator_gain(A, B, 0.5 * (Qbar + Qbar.T), 0.5 * (Rbar + Rbar.T), C.T @ Q @ D)


def output_observer_gain(
    A: FloatArray, E: FloatArray, measured: Outputs, disturbance: FloatArray, noise: FloatArray
) -> FloatArray:
    """Return L of the Kalman-Bucy filter, shape (n, p): (E.9) to (E.12) with the missing transpose.

    Parameters
    ----------
    A, E
        Plant and where the disturbance enters, shapes (n, n), (n, m).
    measured
        Cy and Fy; Fy correlates the noises.
    disturbance, noise
        Spectral densities S_w (m, m) and S_v (p, p).
    """
    Qk = E @ disturbance @ E.T
    Sk = E @ disturbance @ measured.F.T
    Rk = noise + measured.F @ disturbance @ measured.F.T
    return kalman_bucy_gain(A, measured.C, Qk, Rk, Sk)


def sampled_controller(
    A: FloatArray, B: FloatArray, measured: Outputs, feedback: FloatArray, gain: FloatArray, interval_s: float
) -> SampledController:
    """Return the controller (E.5), (E.8) with measurement and force held over each sample.

    Parameters
    ----------
    A, B
        Plant with forces u that push (B as in x' = A x + B u).
    measured
        Cy, Dy.
    feedback, gain
        K and L.
    interval_s
        Sampling interval of the controller [s].
    """
    closed = A - gain @ measured.C
    inputs = np.hstack([B - gain @ measured.D, gain])
    step, pulses = discretise_zero_order(closed, inputs, interval_s)
    k = B.shape[1]
    return SampledController(
        step=step,
        step_force=pulses[:, :k],
        gain=pulses[:, k:],
        feedback=feedback,
        measure=measured.C,
        measure_force=measured.D,
        interval_s=interval_s,
    )


def sampled_loop_radius(A: FloatArray, B: FloatArray, controller: SampledController) -> float:
    """Return the spectral radius of plant and sampled controller together; below 1 the loop is stable.

    Parameters
    ----------
    A, B
        Plant, forces that push.
    controller
        Controller whose measurement contains the force of the previous sample, as in a run.
    """
    n, k = B.shape
    m = controller.step.shape[0]
    step, pulse = discretise_zero_order(A, B, controller.interval_s)
    joint = np.zeros((n + m + k, n + m + k))
    joint[:n, :n] = step
    joint[:n, n : n + m] = -pulse @ controller.feedback
    joint[n : n + m, :n] = controller.gain @ controller.measure
    joint[n : n + m, n : n + m] = controller.step
    joint[n : n + m, n + m :] = -controller.step_force - controller.gain @ controller.measure_force
    joint[n + m :, n : n + m] = controller.feedback
    return float(np.abs(np.linalg.eigvals(joint)).max())
