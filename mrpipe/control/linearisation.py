"""Equivalent linearisation of a law in harmonic motion (4.21) to (4.29): equal dissipated energy, equal mean slope."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.limits import FRICTION_RATIO

SAMPLES = 4096
"""Number of samples of a cycle."""


def equivalent_stiffness(
    force: Callable[[FloatArray, FloatArray], FloatArray], amplitude_m: float, omega: float
) -> complex:
    """Return H [N/m], the ratio of the fundamental of the force to that of the displacement.

    Parameters
    ----------
    force
        Function from displacement (n,) [m] and velocity (n,) [m/s] of one cycle to the force (n,) [N].
    amplitude_m, omega
        Amplitude [m] and angular frequency [rad/s] of the motion.
    """
    phase = 2.0 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES
    x = amplitude_m * np.sin(phase)
    v = amplitude_m * omega * np.cos(phase)
    f = np.asarray(force(x, v))
    return complex(np.mean(f * np.sin(phase)), np.mean(f * np.cos(phase))) * 2.0 / amplitude_m


def clipped_linear_stiffness(c: float, k: float, omega: float) -> complex:
    """Return the exact H [N/m] of f = c v + k x, clipped where it would add energy to the structure (P2 (22)).

    Over a half cycle the force acts over pi less the angle arctan(|k|/(c omega)).
    """
    b = c * omega
    lost = math.atan2(abs(k), b)
    # integrals of sin^2, cos^2 and sin cos over what is clipped, next to an extremum of displacement
    square_sin = 0.5 * lost + 0.25 * math.sin(2.0 * lost)
    square_cos = 0.5 * lost - 0.25 * math.sin(2.0 * lost)
    product = 0.5 * math.sin(lost) ** 2
    real = k * (0.5 * np.pi - square_sin) + math.copysign(b * product, k)
    imaginary = b * (0.5 * np.pi - square_cos) + abs(k) * product
    return complex(real, imaginary) * 2.0 / np.pi


def friction_stiffness(alpha: float) -> complex:
    """Return H [N/m] of fdns with k = -alpha (4.24), and of the neural loop with f_m = 2 alpha X (4.29)."""
    return alpha * complex(-1.0, FRICTION_RATIO)


def clipped_force(c: float, k: float, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return f = c v + k x, or zero where it would add energy to the structure (P2 (22)); same shape as `x`."""
    force = c * v + k * x
    return np.where(force * v >= 0.0, force, 0.0)
