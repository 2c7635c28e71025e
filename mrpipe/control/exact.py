"""Exact complex eigenvalue of a frame with a linear device: damping, optimal gain, maps over the gains."""

from __future__ import annotations

import cmath
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from mrpipe.artifacts import FloatArray
from mrpipe.control.following import followed_pole
from mrpipe.control.limits import STILL, LimitingModes
from mrpipe.control.linearisation import friction_stiffness
from mrpipe.control.loop_pole import GainArray, Structure, followed_root, structure_of
from mrpipe.structures import Frame, state_space

ComplexArray = NDArray[np.complex128]

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
        Largest real part of all poles [1/s]; 0 if only the target mode was computed and no pole can grow.
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


def pole_slope(modes: LimitingModes, H: complex) -> complex:
    """Return the first-order change of the pole i omega_0 [rad/s] by a device of complex stiffness H [N/m]."""
    return -(modes.u_0**2) * H / (2.0 * complex(0.0, modes.omega_0))


@dataclass(frozen=True)
class TargetMode:
    """Target mode of one structure, whose pole is followed with many devices.

    Attributes
    ----------
    structure
        The structure without a device.
    modes
        The target.
    start
        Pole of the target mode without a device [rad/s].
    all_poles
        Whether `unstable_pole` is always computed from all poles. Otherwise it is 0 if the device and the structure
        cannot feed a motion, which saves an eigenvalue problem for each device.
    """

    structure: Structure
    modes: LimitingModes
    start: complex
    all_poles: bool = False

    def linear(self, c: float, k: float) -> ExactDamping:
        """Follow the pole while the linear device f = c v + k x increases from zero; c in N s/m, k in N/m."""
        w = self.structure.position
        return self.feedback(np.concatenate([k * w, c * w]))

    def feedback(self, gain: FloatArray) -> ExactDamping:
        """Follow the pole while the state feedback f = gain' [x, v], shape (2n,), increases from zero."""
        n = self.structure.frame.floors
        displacement, velocity = gain[:n], gain[n:]
        shape, u_0 = self.modes.shape_0, self.modes.u_0
        own = complex(displacement @ shape, self.modes.omega_0 * (velocity @ shape)) / u_0
        space = state_space(self.structure.frame, self.structure.position)

        def upper(share: float) -> ComplexArray:
            poles = np.linalg.eigvals(space.A - share * np.outer(space.B[:, 1], gain))
            return np.asarray(poles[poles.imag >= -1e-9], dtype=np.complex128)

        pole = self._followed(displacement, velocity, own, upper)
        growth = None if self.all_poles else self._known_growth(displacement, velocity)
        if growth is None:
            poles = upper(1.0)
            worst = complex(poles[np.argmax(poles.real)])
        else:
            worst = complex(growth, 0.0)
        return ExactDamping(worst if worst.real > 1e-9 else pole, worst.real)

    def equivalent(self, H: complex) -> ExactDamping:
        """Follow the pole while a device of constant complex stiffness f = H x [N/m] increases from zero.

        The poles are those of (K + H w w' + s C + s^2 M) u = 0 in the upper half plane, where the equivalent holds.
        Those in the lower half plane belong to its complex conjugate.
        """
        frame, w = self.structure.frame, self.structure.position
        A = state_space(frame).A.astype(np.complex128)
        device = np.linalg.solve(frame.mass, np.outer(w, w))

        def upper(share: float) -> ComplexArray:
            changed = A.copy()
            changed[frame.floors :, : frame.floors] -= share * H * device
            poles = np.linalg.eigvals(changed)
            return np.asarray(poles[poles.imag > 0.0], dtype=np.complex128)

        pole = self._followed(np.asarray(H * w, dtype=np.complex128), np.zeros(w.size), H, upper)
        # the loss of the device dissipates in every mode of the upper half plane
        grows_never = not self.all_poles and self.structure.is_undamped and H.imag >= 0.0
        return ExactDamping(pole, 0.0 if grows_never else float(np.max(upper(1.0).real)))

    def _followed(
        self,
        displacement: GainArray,
        velocity: GainArray,
        own: complex,
        upper: Callable[[float], ComplexArray],
    ) -> complex:
        if not (np.any(displacement) or np.any(velocity)):
            return self.start
        loop, slope = self.structure.loop(displacement, velocity), pole_slope(self.modes, own)
        pole = followed_root(loop, self.start, slope, is_real=not np.iscomplexobj(displacement))
        return followed_pole(upper, complex(0.0, self.modes.omega_0), slope) if pole is None else pole

    def _known_growth(self, displacement: FloatArray, velocity: FloatArray) -> float | None:
        """Return the growth [1/s] with a passive viscosity along w in an undamped structure, else None.

        Such a structure grows only if the stiffness is negative beyond the static limit. One real pole is then
        positive.
        """
        w = self.structure.position
        place = int(np.argmax(np.abs(w)))
        c, k = velocity[place] / w[place], displacement[place] / w[place]
        along = np.allclose(velocity, c * w, rtol=1e-14, atol=0.0) and np.allclose(
            displacement, k * w, rtol=1e-14, atol=0.0
        )
        if not (self.structure.is_undamped and along and c >= 0.0):
            return None
        loop = self.structure.loop(displacement, velocity)
        if 1.0 + loop(0.0)[0].real >= 0.0:
            return 0.0
        high = self.modes.omega_0
        while 1.0 + loop(high)[0].real <= 0.0:
            high *= 2.0
        return float(brentq(lambda s: 1.0 + loop(s)[0].real, 0.0, high, xtol=1e-14 * high, rtol=1e-13))


def target_mode(frame: Frame, position: FloatArray, modes: LimitingModes) -> TargetMode:
    """Return the target mode of a frame with a device along `position`, shape (n,)."""
    structure = structure_of(frame, position)
    if structure.shapes is None:
        poles = np.asarray(np.linalg.eigvals(state_space(frame).A), dtype=np.complex128)
        expected = complex(0.0, modes.omega_0)
    else:
        moved = structure.shapes[:, np.abs(position @ structure.shapes) > STILL * abs(modes.u_0)]
        squared = np.sum(moved * (0.5 * (frame.stiffness + frame.stiffness.T) @ moved), axis=0)
        half = 0.5 * np.sum(moved * (frame.damping @ moved), axis=0)
        poles = -half + np.sqrt((half**2 - squared).astype(np.complex128))
        own = 0.5 * complex(modes.shape_0 @ frame.damping @ modes.shape_0)
        expected = -own + cmath.sqrt(own**2 - modes.omega_0**2)
    poles = poles[poles.imag >= -1e-9 * np.abs(poles)]
    return TargetMode(structure, modes, complex(poles[np.argmin(np.abs(poles - expected))]))


def exact_damping(frame: Frame, position: FloatArray, modes: LimitingModes, c: float, k: float) -> ExactDamping:
    """Return the eigenvalue of the target mode with the linear device f = c v + k x.

    Parameters
    ----------
    frame, position
        Structure and connectivity vector w, shape (n,).
    modes
        The target.
    c, k
        Viscosity [N s/m] and stiffness [N/m] of the device.
    """
    return replace(target_mode(frame, position, modes), all_poles=True).linear(c, k)


def exact_equivalent(frame: Frame, position: FloatArray, modes: LimitingModes, H: complex) -> ExactDamping:
    """Return the eigenvalue of the target mode with a device of constant complex stiffness f = H x.

    This is the equivalent of a law whose loop does not depend on frequency, such as FDNS (4.24).

    Parameters
    ----------
    frame, position, modes
        As in :func:`exact_damping`.
    H
        Complex stiffness H of the device [N/m].
    """
    return replace(target_mode(frame, position, modes), all_poles=True).equivalent(H)


def exact_friction(frame: Frame, position: FloatArray, modes: LimitingModes, alpha: float) -> ExactDamping:
    """Return the eigenvalue of the target mode with the equivalent of fdns, H = alpha (i 4/pi - 1) (4.24)."""
    return exact_equivalent(frame, position, modes, friction_stiffness(alpha))


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
    target = target_mode(frame, position, modes)
    answers = [[target.linear(float(viscosity), float(stiffness)) for viscosity in c] for stiffness in k]
    return np.array([[item.damping_ratio if item.stable else np.nan for item in row] for row in answers])


def friction_map(frame: Frame, position: FloatArray, modes: LimitingModes, alpha: FloatArray) -> FloatArray:
    """Return exact damping ratios of the equivalent of FDNS over alpha, shape (len(alpha),); NaN where unstable."""
    target = target_mode(frame, position, modes)
    answers = [target.equivalent(friction_stiffness(float(value))) for value in alpha]
    return np.array([item.damping_ratio if item.stable else np.nan for item in answers])
