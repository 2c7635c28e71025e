"""The two limiting eigenproblems and the closed forms that follow from them (thesis 4.2, 4.3; P2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import eigh, null_space

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.structures import Frame

FRICTION_RATIO = 4.0 / math.pi
"""Ratio of the viscous part to the stiffness part of the equivalent (4.24)."""


class TwoLimits(Protocol):
    """Frequencies of a mode without and with a locked device, as far as the closed forms need them."""

    @property
    def omega_0(self) -> float:
        """Angular frequency with the device free [rad/s]."""

    @property
    def omega_inf(self) -> float:
        """Angular frequency with the device locked [rad/s]."""

    @property
    def u_0(self) -> float:
        """Amplitude of the free mode at the device, of unit modal mass [1/sqrt(kg)]."""


def modal_flexibility(limits: TwoLimits) -> float:
    """Return nu of P2 (8), mu of (4.9): u_0^2/(omega_inf^2 - omega_0^2) [m/N]."""
    return limits.u_0**2 / (limits.omega_inf**2 - limits.omega_0**2)


@dataclass(frozen=True)
class LimitingModes:
    """Free and locked mode of the target mode, and the reduced model that follows from them.

    Attributes
    ----------
    mode
        Number of the target mode, from 1.
    omega_0, omega_inf
        Angular frequency with the damper free (4.4) and locked [rad/s]; omega_inf is infinite if the target is the
        only mode that moves the damper, as in a structure with one degree of freedom.
    shape_0, shape_inf
        Mode shapes of unit modal mass (4.5), shape (n,) [1/sqrt(kg)]; the damper does not move in the locked shape,
        which is zero if omega_inf is infinite.
    u_0
        Amplitude of the free mode at the damper [1/sqrt(kg)].
    kappa
        Coupling of the two shapes, shape_inf' M shape_0 [1]; the closed forms assume 1.
    top
        Index of the top, the last degree of freedom that moves with the ground.
    """

    mode: int
    omega_0: float
    omega_inf: float
    shape_0: FloatArray
    shape_inf: FloatArray
    u_0: float
    kappa: float
    top: int = -1

    @property
    def top_0(self) -> float:
        """Amplitude of the free mode at the top [1/sqrt(kg)]."""
        return float(self.shape_0[self.top])

    @property
    def nu(self) -> float:
        """Modal flexibility of P2 (8), mu of (4.9): u_0^2/(omega_inf^2 - omega_0^2) [m/N]."""
        return modal_flexibility(self)

    @property
    def is_single(self) -> bool:
        """Whether the target is the only mode that moves the damper, so that a locked damper leaves no motion."""
        return math.isinf(self.omega_inf)

    @property
    def modal_stiffness(self) -> float:
        """Stiffness omega_0^2/u_0^2 of the free mode at the damper [N/m]; for one degree of freedom the stiffness."""
        return (self.omega_0 / self.u_0) ** 2

    @property
    def share_p2(self) -> float:
        """(omega_inf - omega_0)/(omega_inf + omega_0) of P2 (7) [1]."""
        return 1.0 if self.is_single else (self.omega_inf - self.omega_0) / (self.omega_inf + self.omega_0)


def highest_frequency(omega_0: float, omega_inf: float) -> float:
    """Return the angular frequency up to which a device can raise that of its target mode [rad/s].

    It is omega_inf. If this is infinite, it is twice omega_0, which needs a device with three times the stiffness of
    the structure.
    """
    return 2.0 * omega_0 if math.isinf(omega_inf) else omega_inf


SAME_FREQUENCY = 1e-6
"""Relative difference below which two frequencies are equal: matrices in a file have about as many digits."""

STILL = 1e-9
"""Ratio of the stroke of a mode to the largest stroke of all modes, below which the stroke is only a rounding error."""


def limiting_modes(frame: Frame, position: FloatArray, mode: int = 1) -> LimitingModes:
    """Solve the free (4.4) and the locked eigenproblem; (4.5), (4.6), P2 (6).

    The locked problem is that on the subspace w'x = 0. The locked mode that belongs to the target is the one of the
    same number: locking raises each frequency to at most the next one. Modes that do not move the damper, such as those
    across its direction, are the same in both problems and are not counted. If only one mode moves the damper, the
    locked frequency is infinite.

    Parameters
    ----------
    frame
        The structure.
    position
        Connectivity vector w, shape (n,).
    mode
        Number of the target mode, from 1.

    Raises
    ------
    UserError
        If the mass is singular or indefinite, the mode has no locked partner, or the damper is at a node of the mode.
    """
    n = frame.floors
    w = np.asarray(position, dtype=np.float64)
    if w.shape != (n,) or not np.any(w):
        raise UserError("calibrate", "position", f"has {w.size} entries", f"{n} floors need {n}, not all zero")
    if not 1 <= mode <= n:
        remedy = f"with {n} degrees of freedom and a locked damper it is 1{f' to {n - 1}' if n > 2 else ''}"
        if n == 1:
            remedy = "with one degree of freedom it is 1"
        raise UserError("calibrate", "target_mode", f"is {mode}", remedy)
    M = 0.5 * (frame.mass + frame.mass.T)
    K = 0.5 * (frame.stiffness + frame.stiffness.T)
    if not np.all(np.linalg.eigvalsh(M) > 0.0):
        raise UserError(f"frame {frame.name}", "mass", "is singular or negative", "every floor needs a positive mass")
    squared, shapes = eigh(K, M)
    shapes = separated(w, np.sqrt(np.maximum(squared, 0.0)), shapes)
    if squared[mode - 1] <= 0.0:
        raise UserError(f"frame {frame.name}", "stiffness", f"mode {mode} is unstable", "identify the frame again")
    moving = moving_modes(w, shapes)
    if mode not in moving:
        listed = ", ".join(map(str, moving[:6]))
        problem = f"mode {mode} does not move the damper"
        raise UserError(
            "calibrate", "place of the damper", problem, f"choose another place, or a target mode among {listed}"
        )
    shape_0 = shapes[:, mode - 1] * (1.0 if shapes[frame.top, mode - 1] >= 0.0 else -1.0)
    u_0, omega_0 = float(w @ shape_0), math.sqrt(squared[mode - 1])
    if moving == [mode]:
        return LimitingModes(mode, omega_0, math.inf, shape_0, np.zeros(n), u_0, 0.0, frame.top)
    if len(moving) == n:
        basis = null_space(w[None, :])
    else:
        coupled = shapes[:, np.array(moving) - 1]
        basis = coupled @ null_space((w @ coupled)[None, :])
    locked_squared, locked = eigh(basis.T @ K @ basis, basis.T @ M @ basis)
    partner = moving.index(mode)
    if partner >= locked_squared.size:
        problem = f"mode {mode} is the last one that moves the damper, so that it has no locked partner"
        raise UserError("calibrate", "target_mode", problem, f"choose one of {', '.join(map(str, moving[:-1][:6]))}")
    shape_inf = basis @ locked[:, partner]
    kappa = float(shape_inf @ M @ shape_0)
    if kappa < 0.0:
        shape_inf, kappa = -shape_inf, -kappa
    omega_inf = math.sqrt(locked_squared[partner])
    if omega_inf - omega_0 < 1e-6 * omega_0:
        raise UserError("calibrate", "place of the damper", f"mode {mode} does not move it", "choose another place")
    return LimitingModes(mode, omega_0, omega_inf, shape_0, shape_inf, u_0, kappa, frame.top)


def equal_frequencies(angular_frequencies: FloatArray) -> list[list[int]]:
    """Return the indices (from 0) of the modes in groups of equal frequency; most groups hold one mode."""
    groups: list[list[int]] = []
    for index, omega in enumerate(angular_frequencies):
        if groups and omega - angular_frequencies[groups[-1][-1]] <= SAME_FREQUENCY * omega:
            groups[-1].append(index)
        else:
            groups.append([index])
    return groups


def separated(position: FloatArray, angular_frequencies: FloatArray, shapes: FloatArray) -> FloatArray:
    """Return mode shapes of which at most one in each group of equal frequency moves the damper, shape (n, n).

    Every combination of modes of equal frequency is a mode. A symmetric building has such pairs, and the damper moves
    one combination of each pair only.

    Parameters
    ----------
    position
        Connectivity vector w, shape (n,).
    angular_frequencies, shapes
        Frequencies and shapes of all modes, shape (n,) [rad/s] and (n, n), unit modal mass.
    """
    result = shapes.copy()
    smallest = STILL * float(np.max(np.abs(position @ shapes)))
    for group in equal_frequencies(angular_frequencies):
        stroke = position @ shapes[:, group]
        if np.count_nonzero(np.abs(stroke) > smallest) > 1:
            first = stroke / np.linalg.norm(stroke)
            result[:, group] = shapes[:, group] @ np.column_stack([first, null_space(first[None, :])])
    return result


def moving_modes(position: FloatArray, shapes: FloatArray) -> list[int]:
    """Return the numbers (from 1) of the modes that move a damper; `shapes` have unit modal mass."""
    stroke = np.abs(position @ shapes)
    return [int(place) + 1 for place in np.flatnonzero(stroke > STILL * float(np.max(stroke)))]


def static_stiffness(frame: Frame, position: FloatArray) -> float:
    """Return 1/(w' K^-1 w) [N/m]: a device stiffness below minus this value is unstable (errata row 8)."""
    return float(1.0 / (position @ np.linalg.solve(frame.stiffness, position)))


# --- closed forms; for a single mode those of an oscillator of mass 1/u_0^2 ---


def damping_estimate(modes: LimitingModes, stiffness: float, loss: float) -> float:
    """Return zeta of P2 (7) for a device with Re H = `stiffness`, Im H = `loss` [N/m].

    For a single mode of modal stiffness k_0 it is loss/(2 (k_0 + stiffness)), which is the dissipated energy of a cycle
    over 4 pi times the strain energy. It is NaN if the stiffness is not positive.
    """
    if modes.is_single:
        whole = modes.modal_stiffness + stiffness
        return loss / (2.0 * whole) if whole > 0.0 else math.nan
    real, imaginary = modes.nu * stiffness, modes.nu * loss
    return modes.share_p2 * 2.0 * imaginary / ((1.0 + real) ** 2 + imaginary**2)


def optimal_viscosity(modes: LimitingModes, stiffness: float = 0.0) -> float:
    """Return c [N s/m] of P2 (13), with the factor 1/omega_0 that is missing in print (errata row 12).

    For a single mode it is c of critical damping, 2 sqrt((k_0 + stiffness)/u_0^2).

    Raises
    ------
    UserError
        If the damper moves a single mode, and its stiffness is not above minus that of the structure.
    """
    if not modes.is_single:
        return 1.0 / (modes.nu * modes.omega_0) + stiffness / modes.omega_0
    whole = modes.modal_stiffness + stiffness
    if whole <= 0.0:
        problem = f"is {stiffness:.4g} N/m, so that the structure has no stiffness with the damper"
        raise UserError("calibrate", "negative_stiffness_n_m", problem, f"above {-modes.modal_stiffness:.4g} N/m")
    return 2.0 * math.sqrt(whole) / abs(modes.u_0)


def optimal_viscosity_thesis(modes: LimitingModes | TwoLimits, stiffness: float = 0.0) -> float:
    """Return c [N s/m] of (4.13) and (4.16), with omega_inf + omega_0 instead of 2 omega_0; infinite omega_inf: inf."""
    return 2.0 * (modes.omega_inf - modes.omega_0) / modes.u_0**2 + stiffness / modes.omega_0


def attainable_damping(modes: LimitingModes, stiffness: float = 0.0) -> float:
    """Return zeta_max of P2 (14); 1, critical damping, for a single mode."""
    return modes.share_p2 / (1.0 + modes.nu * stiffness)


def inherent_damping(frame: Frame, modes: LimitingModes) -> float:
    """Return the damping ratio of the free target mode without the damper [1]: phi' C phi/(2 omega_0)."""
    return float(modes.shape_0 @ frame.damping @ modes.shape_0) / (2.0 * modes.omega_0)


def placement_warning(frame: Frame, modes: LimitingModes) -> str:
    """Return a warning if the damper hardly acts on the target mode; empty if it acts on it.

    A damper without stiffness adds at most the damping ratio of P2 (14). If this is less than the inherent damping
    ratio of the mode, no gain of such a law can double the damping of the mode. Negative stiffness raises the bound by
    P2 (14).
    """
    most, present = attainable_damping(modes), inherent_damping(frame, modes)
    if most >= present:
        return ""
    return (
        f"the damper hardly acts on mode {modes.mode}: locking it raises the frequency of the mode only from "
        f"{modes.omega_0:.4g} to {modes.omega_inf:.4g} rad/s. A damper without stiffness therefore adds a damping "
        f"ratio of at most {most:.2g}, and the mode has {present:.2g} without it. Choose another place of the damper, "
        "or another target mode"
    )


def optimal_friction(modes: LimitingModes | TwoLimits) -> float:
    """Return alpha [N/m] of (4.25), P2 (20); for a single mode, whose equivalent has no optimum, the critical alpha."""
    if math.isinf(modes.omega_inf):
        return critical_friction(modes)
    return 1.0 / (modal_flexibility(modes) * math.hypot(1.0, FRICTION_RATIO))


def critical_friction(modes: TwoLimits) -> float:
    """Return alpha [N/m] with which a free vibration of the target mode ends after half a cycle: a third of k_0.

    From an extremum X a mode of modal stiffness k_0 = omega_0^2/u_0^2 moves about alpha X/(k_0 - alpha) with the
    stiffness k_0 - alpha, so that the next extremum is -X (k_0 - 3 alpha)/(k_0 - alpha).
    """
    return (modes.omega_0 / modes.u_0) ** 2 / 3.0


def holding_friction(modes: TwoLimits) -> float:
    """Return alpha [N/m] from which the friction holds the target mode at its extremum: half of k_0.

    The force 2 alpha X is then as large as the restoring force k_0 X. The equivalent (4.24) assumes a harmonic motion,
    so that it does not hold beyond this alpha.
    """
    return 0.5 * (modes.omega_0 / modes.u_0) ** 2


def largest_friction(modes: LimitingModes) -> float:
    """Return the largest alpha [N/m] of a search or a diagram: 2/nu; for a single mode its modal stiffness."""
    return modes.modal_stiffness if modes.is_single else 2.0 / modes.nu


def attainable_damping_friction(modes: LimitingModes) -> float:
    """Return zeta_max of P2 (21); for a single mode the estimate at the optimal alpha."""
    if modes.is_single:
        alpha = optimal_friction(modes)
        return damping_estimate(modes, -alpha, FRICTION_RATIO * alpha)
    return modes.share_p2 * FRICTION_RATIO / (math.hypot(1.0, FRICTION_RATIO) - 1.0)


def optimal_force_ratio(modes: LimitingModes) -> float:
    """Return f_m/X [N/m] of (4.30): twice alpha, with 1.24 written out as 2/sqrt(1 + (4/pi)^2)."""
    return 2.0 * optimal_friction(modes)
