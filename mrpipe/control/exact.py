"""Exact complex eigenvalue of a frame with a linear device: damping, optimal gain, maps over the gains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from mrpipe.artifacts import FloatArray
from mrpipe.control.following import followed_pole
from mrpipe.control.limits import FRICTION_RATIO, LimitingModes
from mrpipe.structures import Frame, state_space

CRITICAL = 1.0 - 1e-9
"""Damping ratio from which a mode counts as critically damped."""


@dataclass(frozen=True)
class ExactDamping:
    """Target mode of a frame with a device.

    Attributes
    ----------
    pole
        Pole s of the target mode [rad/s].
    unstable_pole
        Largest real part of all poles [1/s].
    """

    pole: complex
    unstable_pole: float

    @property
    def stable(self) -> bool:
        """Whether no pole has a positive real part."""
        return self.unstable_pole < 1e-9

    @property
    def damping_ratio(self) -> float:
        """-Re s/|s| of the target mode [1]; -1 if a pole grows and the pole of the target mode is real."""
        if not self.stable and abs(self.pole.imag) < 1e-9:
            return -1.0
        return float(-self.pole.real / max(abs(self.pole), 1e-300))


def _poles(frame: Frame, position: FloatArray, c: float, k: float) -> NDArray[np.complex128]:
    device = np.outer(position, position)
    changed = replace(frame, damping=frame.damping + c * device, stiffness=frame.stiffness + k * device)
    return np.asarray(np.linalg.eigvals(state_space(changed).A), dtype=np.complex128)


def pole_slope(modes: LimitingModes, H: complex) -> complex:
    """Return the first-order change of the pole i omega_0 [rad/s] by a device of complex stiffness H [N/m]."""
    return -(modes.u_0**2) * H / (2.0 * complex(0.0, modes.omega_0))


def exact_damping(frame: Frame, position: FloatArray, modes: LimitingModes, c: float, k: float) -> ExactDamping:
    """Follow the eigenvalue of the target mode while the linear device f = c v + k x increases from zero.

    Parameters
    ----------
    frame, position
        Structure and connectivity vector w, shape (n,).
    modes
        The target.
    c, k
        Viscosity [N s/m] and stiffness [N/m] of the device.
    """

    def upper(share: float) -> NDArray[np.complex128]:
        poles = _poles(frame, position, share * c, share * k)
        return poles[poles.imag >= -1e-9]

    start = complex(0.0, modes.omega_0)
    pole = followed_pole(upper, start, pole_slope(modes, c * start + k))
    poles = upper(1.0)
    worst = complex(poles[np.argmax(poles.real)])
    if worst.real > 1e-9:
        pole = worst
    return ExactDamping(pole, worst.real)


def exact_equivalent(frame: Frame, position: FloatArray, modes: LimitingModes, H: complex) -> ExactDamping:
    """Follow the eigenvalue of the target mode with a device of constant complex stiffness f = H x.

    This is the equivalent of a law whose loop does not depend on frequency, such as FDNS (4.24); the eigenvalues are
    those of (K + H w w' + i omega C - omega^2 M) u = 0 with Re omega > 0, so that s = i omega.

    Parameters
    ----------
    frame, position, modes
        As in :func:`exact_damping`.
    H
        Complex stiffness H of the device [N/m].
    """
    n = frame.floors
    inverse = np.linalg.inv(frame.mass)
    A = np.zeros((2 * n, 2 * n), dtype=np.complex128)
    A[:n, n:] = np.eye(n)
    A[n:, n:] = -inverse @ frame.damping

    def upper(share: float) -> NDArray[np.complex128]:
        A[n:, :n] = -inverse @ (frame.stiffness + share * H * np.outer(position, position))
        poles = np.asarray(np.linalg.eigvals(A), dtype=np.complex128)
        # the equivalent holds for the upper half plane only: poles below belong to its complex conjugate
        return poles[poles.imag > 0.0]

    pole = followed_pole(upper, complex(0.0, modes.omega_0), pole_slope(modes, H))
    return ExactDamping(pole, float(np.max(upper(1.0).real)))


def exact_friction(frame: Frame, position: FloatArray, modes: LimitingModes, alpha: float) -> ExactDamping:
    """Return the eigenvalue of the target mode with the equivalent of fdns, H = alpha (i 4/pi - 1) (4.24)."""
    return exact_equivalent(frame, position, modes, alpha * complex(-1.0, FRICTION_RATIO))


def stable_ratio(answer: ExactDamping) -> float:
    """Return the damping ratio; -1 if a pole grows, so that a search for the best gain avoids this gain."""
    return answer.damping_ratio if answer.stable else -1.0


def undamped(frame: Frame) -> Frame:
    """Return the frame without inherent damping, because the closed forms and the figures of the thesis assume none."""
    return replace(frame, damping=np.zeros_like(frame.damping))


@dataclass(frozen=True)
class Optimum:
    """Gain with the largest exact damping ratio, and this damping ratio."""

    gain: float
    damping_ratio: float


def best_gain(damping_ratio: Callable[[float], float], largest: float) -> Optimum:
    """Return the gain between 0 and `largest` with the largest damping ratio, by a scan and then Brent's method.

    If the mode can be overdamped, the result is the smallest gain that damps it critically. The damping ratio is 1
    beyond this gain too, but the mode then returns more slowly, and other modes have less damping.
    """
    scan = np.linspace(largest / 40.0, largest, 40)
    values = [damping_ratio(float(gain)) for gain in scan]
    best = int(np.argmax(values))
    low, high = float(scan[best - 1]) if best else 0.0, float(scan[min(best + 1, len(scan) - 1)])
    if values[best] >= CRITICAL:
        critical = first_critical(damping_ratio, low, float(scan[best]))
        return Optimum(critical, damping_ratio(critical))
    found = minimize_scalar(lambda gain: -damping_ratio(float(gain)), bounds=(low, high), method="bounded")
    return Optimum(float(found.x), float(-found.fun))


def first_critical(damping_ratio: Callable[[float], float], low: float, high: float) -> float:
    """Return the smallest gain with critical damping between `low`, which has less, and `high`, which has it."""
    for _ in range(40):
        middle = 0.5 * (low + high)
        if damping_ratio(middle) >= CRITICAL:
            high = middle
        else:
            low = middle
    return high


def damping_map(frame: Frame, position: FloatArray, modes: LimitingModes, c: FloatArray, k: FloatArray) -> FloatArray:
    """Return exact damping ratios, shape (len(k), len(c)), of f = c v + k x; NaN if statically unstable."""
    result = np.full((len(k), len(c)), np.nan)
    for row, stiffness in enumerate(k):
        for column, viscosity in enumerate(c):
            answer = exact_damping(frame, position, modes, float(viscosity), float(stiffness))
            if answer.stable:
                result[row, column] = answer.damping_ratio
    return result


def friction_map(frame: Frame, position: FloatArray, modes: LimitingModes, alpha: FloatArray) -> FloatArray:
    """Return exact damping ratios of the equivalent of FDNS over alpha, shape (len(alpha),); NaN where unstable."""
    answers = [exact_friction(frame, position, modes, float(value)) for value in alpha]
    return np.array([answer.damping_ratio if answer.stable else np.nan for answer in answers])
