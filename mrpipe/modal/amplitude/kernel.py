"""Compiled simulation of modes whose frequency and damping depend on the amplitude of the motion."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, njit, void

_LARGEST_DAMPING = 0.5


@njit(
    void(
        float64[:, ::1],
        float64,
        float64[:, ::1],
        boolean,
        float64[:, ::1],
        float64[:, ::1],
        float64[:, ::1],
        float64[::1],
    ),
    cache=True,
)
def simulate_modes(  # type: ignore[no-untyped-def]
    forces, dt, laws, total, initial, displacement, acceleration, amplitude
):
    """Simulate modes; write displacement and acceleration of each, and the amplitude of the whole motion.

    Within a step the mode is linear with the frequency and damping of the amplitude at its beginning, and the force is
    linear in time; that linear problem is solved exactly.

    Parameters
    ----------
    forces
        Shape (m, r): force over modal mass [m/s2].
    dt
        Sampling interval [s].
    laws
        Shape (r, 5): angular frequency [rad/s] and damping ratio at zero amplitude, exponent of softening, exponent of
        damping, reference amplitude [m].
    total
        Whether the amplitude of a law is that of the whole motion; otherwise that of the mode itself.
    initial
        Shape (r, 2): displacement [m] and velocity [m/s] at the first sample.
    displacement, acceleration
        Shape (m, r): results [m], [m/s2].
    amplitude
        Shape (m,): result [m].
    """
    samples, modes = forces.shape
    position = initial[:, 0].copy()
    velocity = initial[:, 1].copy()
    # frequency, damping ratio, damped frequency, and decay, cosine and sine over one step
    values = np.zeros((modes, 6))
    for k in range(samples):
        whole = 0.0
        for r in range(modes):
            whole += position[r] ** 2 + (velocity[r] / laws[r, 0]) ** 2
        whole = np.sqrt(whole)
        amplitude[k] = whole
        for r in range(modes):
            if k == 0 or laws[r, 2] != 0.0 or laws[r, 3] != 0.0:
                own = whole if total else np.sqrt(position[r] ** 2 + (velocity[r] / laws[r, 0]) ** 2)
                level = np.log1p(own / laws[r, 4])
                omega = laws[r, 0] * np.exp(-laws[r, 2] * level)
                zeta = min(laws[r, 1] * np.exp(laws[r, 3] * level), _LARGEST_DAMPING)
                damped = omega * np.sqrt(1.0 - zeta**2)
                values[r, 0], values[r, 1], values[r, 2] = omega, zeta, damped
                values[r, 3] = np.exp(-zeta * omega * dt)
                values[r, 4], values[r, 5] = np.cos(damped * dt), np.sin(damped * dt)
            omega, zeta, damped = values[r, 0], values[r, 1], values[r, 2]
            decay, cosine, sine = values[r, 3], values[r, 4], values[r, 5]
            displacement[k, r] = position[r]
            acceleration[k, r] = forces[k, r] - 2.0 * zeta * omega * velocity[r] - omega**2 * position[r]
            if k == samples - 1:
                continue
            slope = (forces[k + 1, r] - forces[k, r]) / dt
            # particular solution of the ramp: constant + linear
            linear = slope / omega**2
            constant = (forces[k, r] - 2.0 * zeta * omega * linear) / omega**2
            x0, v0 = position[r] - constant, velocity[r] - linear
            position[r] = decay * (x0 * cosine + (v0 + zeta * omega * x0) / damped * sine) + constant + linear * dt
            velocity[r] = decay * (v0 * cosine - (zeta * omega * v0 + omega**2 * x0) / damped * sine) + linear
