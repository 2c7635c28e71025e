"""A pole of a structure with one device, followed by Newton's method on the dynamic stiffness.

s is a pole of the structure with a share of a device if 1 + share T(s) = 0, where T is the loop transfer function from
the force of the device back to itself. The pole therefore solves 1/T(s) = -share. This needs no eigenvalues of the
structure with the device: T is a sum over the modes of the structure without it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, lu_factor, lu_solve

from mrpipe.artifacts import FloatArray
from mrpipe.structures import Frame

GainArray = FloatArray | NDArray[np.complex128]

Loop = Callable[[complex], tuple[complex, complex]]
"""Function from the Laplace variable s [rad/s] to T and its derivative by s [s/rad]."""

FIRST_STEP, SMALLEST_STEP, LARGEST_STEP = 1.0 / 24.0, 2.0**-10 / 24.0, 0.25
"""Steps of the share of the device."""
ITERATIONS, CONVERGED = 12, 1e-13
"""Largest number of Newton iterations of a step, and relative change of the pole at which they end."""
ITERATIONS_DOUBLE, CONVERGED_DOUBLE = 80, 1e-7
"""The same for the smallest step, next to a double pole, where Newton's method is slow and rounding is large."""
CLOSE, VERY_CLOSE = 0.1, 0.02
"""A step is accepted if the prediction misses the pole by less than the first share of the predicted change, and the
next step is twice as long below the second share.
"""
COUPLING = 1e-10
"""Relative size of the matrices between modes below which the modes are decoupled."""


@dataclass(frozen=True)
class Structure:
    """A structure without its device, prepared for loop transfer functions.

    Attributes
    ----------
    frame, position
        The structure and the connectivity vector w of the device, shape (n,).
    squared, damping, shapes
        omega^2, 2 zeta omega and shapes of the modes, shapes (n,), (n,), (n, n); `shapes` is None if damping couples
        the modes, or the stiffness matrix is not symmetric.
    """

    frame: Frame
    position: FloatArray
    squared: FloatArray
    damping: FloatArray
    shapes: FloatArray | None

    @property
    def is_undamped(self) -> bool:
        """Whether the structure has no damping, and its modes are decoupled."""
        return self.shapes is not None and not np.any(self.frame.damping)

    def loop(self, displacement: GainArray, velocity: GainArray) -> Loop:
        """Return T(s) = (displacement + s velocity)' (M s^2 + C s + K)^-1 w of f = displacement'x + velocity'v.

        Parameters
        ----------
        displacement, velocity
            Gains of the force [N/m], [N s/m], shape (n,), real or complex.
        """
        return self._dense(displacement, velocity) if self.shapes is None else self._modal(displacement, velocity)

    def _modal(self, displacement: GainArray, velocity: GainArray) -> Loop:
        assert self.shapes is not None
        strokes = self.position @ self.shapes
        zeroth, first = (displacement @ self.shapes) * strokes, (velocity @ self.shapes) * strokes
        squared, damping = self.squared, self.damping

        def loop(s: complex) -> tuple[complex, complex]:
            inverse = 1.0 / (s * (s + damping) + squared)
            terms = (zeroth + s * first) * inverse
            slope = first @ inverse - (terms * (2.0 * s + damping)) @ inverse
            return complex(terms.sum()), complex(slope)

        return loop

    def _dense(self, displacement: GainArray, velocity: GainArray) -> Loop:
        M, C, K, w = self.frame.mass, self.frame.damping, self.frame.stiffness, self.position

        def loop(s: complex) -> tuple[complex, complex]:
            factors = lu_factor(K + s * C + s**2 * M)
            right, row = lu_solve(factors, w.astype(np.complex128)), displacement + s * velocity
            left = lu_solve(factors, row.astype(np.complex128), trans=1)
            return complex(row @ right), complex(velocity @ right - left @ ((C + 2.0 * s * M) @ right))

        return loop


def structure_of(frame: Frame, position: FloatArray) -> Structure:
    """Return a structure with its modes, if these are decoupled."""
    squared, shapes = eigh(0.5 * (frame.stiffness + frame.stiffness.T), frame.mass)
    damping = shapes.T @ frame.damping @ shapes
    skew = shapes.T @ (0.5 * (frame.stiffness - frame.stiffness.T)) @ shapes
    rates = np.sqrt(np.abs(squared))
    coupling = np.abs(damping - np.diag(np.diag(damping)))
    decoupled = np.all(coupling <= COUPLING * np.max(rates)) and np.all(
        np.abs(skew) <= COUPLING * np.max(np.abs(squared))
    )
    return Structure(frame, position, squared, np.diag(damping).copy(), shapes if decoupled else None)


def followed_root(loop: Loop, start: complex, slope: complex, *, is_real: bool) -> complex | None:
    """Follow the pole while the share of the device increases from 0 to 1; None if Newton's method does not converge.

    Each value is predicted on the tangent. A step after which the prediction was not close is divided.

    Parameters
    ----------
    loop
        Loop transfer function with the whole device.
    start
        The pole without the device [rad/s], at which T is infinite.
    slope
        Its derivative by the share at share 0 [rad/s].
    is_real
        Whether all gains are real, so that poles are in conjugate pairs, of which the upper one is followed.
    """
    pole, share, step = start, 0.0, FIRST_STEP
    while share < 1.0:
        target = min(1.0, share + step)
        predicted = pole + slope * (target - share)
        if is_real and predicted.imag < 0.0:
            predicted = predicted.conjugate()
        smallest = step <= SMALLEST_STEP
        found = _root(loop, predicted, target, ITERATIONS, CONVERGED)
        if found is None and smallest:
            found = _root(loop, predicted, target, ITERATIONS_DOUBLE, CONVERGED_DOUBLE)
        if found is None:
            if smallest:
                return None
            step *= 0.5
            continue
        root, tangent = found
        if is_real and root.imag < 0.0:
            root, tangent = root.conjugate(), tangent.conjugate()
        missed, moved = abs(root - predicted), abs(predicted - pole)
        if missed > CLOSE * moved + 1e-9 * abs(root) and not smallest:
            step *= 0.5
            continue
        pole, slope, share = root, tangent, target
        if missed < VERY_CLOSE * moved:
            step = min(2.0 * step, LARGEST_STEP)
    return pole


def _root(loop: Loop, s: complex, share: float, iterations: int, converged: float) -> tuple[complex, complex] | None:
    """Return the root of 1/T(s) + share near s, and its derivative by the share; None without convergence."""
    for _ in range(iterations):
        value, derivative = loop(s)
        if value == 0.0 or derivative == 0.0 or not np.isfinite(value) or not np.isfinite(derivative):
            return None
        # 1/T has the derivative -T'/T^2
        change = value * (1.0 + share * value) / derivative
        s += change
        if abs(change) <= converged * abs(s):
            return s, value**2 / derivative
    return None
