"""Functions of the two-stage Rosenbrock method ROS2, which integrates stiff base forms.

For z' = f(z, t) and the slope J = df/dz at the start of a step h,

    (1 - g h J) k1 = f(z, t),    (1 - g h J) k2 = f(z + h k1, t + h) - 2 k1,    z + h (3/2 k1 + 1/2 k2).

With g = 1 - 1/sqrt(2) the method has second order, also with an inexact slope, and it is L-stable: the fastest
solutions vanish within one step. Source: Verwer, Spee, Blom, Hundsdorfer 1999, SIAM J. Sci. Comput. 20, 1456-1480.
"""

from __future__ import annotations

from numba import float64, int64, njit

DAMPING = 1.0 - 0.5 * 2.0**0.5
"""The coefficient g."""

LONGEST = 0.5
"""Longest part of a step, in time constants of the stiffest solution ..."""

MOST_PARTS = 12
"""... but at most this number of parts, because the method remains stable with longer ones."""


@njit(int64(float64, float64), cache=True)
def parts_of_step(fastest: float, dt: float) -> int:
    """Return the number of equal parts of a step `dt` [s] for a solution that decays at the rate `fastest` [1/s]."""
    return min(int(fastest * dt / LONGEST) + 1, MOST_PARTS)


@njit(float64(float64, float64), cache=True)
def damping_factor(h: float, slope: float) -> float:
    """Return 1/(1 - g h J) for a part of `h` [s] and a slope J [1/s]."""
    return 1.0 / (1.0 - DAMPING * h * slope)
