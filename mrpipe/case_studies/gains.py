"""Calibration of the collocated laws on a benchmark structure: closed forms of chapter 4, exact eigenvalues."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.optimize import minimize_scalar

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.model import ModalModel
from mrpipe.control.limits import optimal_friction, optimal_viscosity_thesis


@dataclass(frozen=True)
class TwoComponent:
    """The two limits of one device: no device and a locked one (4.3) to (4.6).

    Attributes
    ----------
    omega_0, omega_inf
        Lowest angular frequency without and with the device locked [rad/s].
    u_0
        Motion of the device in the free mode of unit modal mass [1/sqrt(kg)].
    """

    omega_0: float
    omega_inf: float
    u_0: float

    def viscous(self, stiffness: float = 0.0) -> float:
        """Return c of (4.13), or (4.16) = P4 (22) with a device stiffness k_d [N/m]; N s/m."""
        return optimal_viscosity_thesis(self, stiffness)

    def friction(self) -> float:
        """Return alpha of FDNS (4.25) [N/m]."""
        return optimal_friction(self)


def two_component(modal: ModalModel, device: int = 0, mode: int = 0) -> TwoComponent:
    """Return the limits of a device for one mode, all other devices off.

    Parameters
    ----------
    modal
        All modes of the structure.
    device
        Column of the devices.
    mode
        Which of the modes, both without and with the device locked.
    """
    w = modal.devices[:, device]
    squared = np.diag(modal.angular_frequencies**2)
    basis = null_space(w[None, :])
    locked = eigh(basis.T @ squared @ basis, eigvals_only=True)
    return TwoComponent(float(modal.angular_frequencies[mode]), float(np.sqrt(locked[mode])), float(abs(w[mode])))


def damped_modes(modal: ModalModel, viscous: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return |s| [rad/s] and damping ratio of the oscillating modes with linear devices, by rising |s|.

    Parameters
    ----------
    modal
        The structure.
    viscous, stiffness
        c [N s/m] and k_d [N/m] of each device, shape (k,).
    """
    n = modal.modes
    A = modal.state_matrix()
    A[n:, :n] -= modal.devices @ np.diag(stiffness) @ modal.devices.T
    A[n:, n:] -= modal.devices @ np.diag(viscous) @ modal.devices.T
    poles = np.linalg.eigvals(A)
    poles = poles[poles.imag > 1e-9 * np.abs(poles)]
    poles = poles[np.argsort(np.abs(poles))]
    size = np.abs(poles)
    return np.asarray(size), np.asarray(-poles.real / size)


def lowest_damping(modal: ModalModel, viscous: float, stiffness: float, modes: int = 1) -> float:
    """Return the smallest damping ratio of the lowest oscillating modes, the same gains on every device."""
    k = modal.devices.shape[1]
    _, ratios = damped_modes(modal, np.full(k, viscous), np.full(k, stiffness))
    return float(ratios[:modes].min()) if len(ratios) else 1.0


def exact_viscous(modal: ModalModel, stiffness: float, scale: float, modes: int = 1) -> float:
    """Return c [N s/m] that makes the least damped of the lowest modes most damped, by complex eigenvalues.

    Parameters
    ----------
    modal
        The structure.
    stiffness
        k_d of every device [N/m].
    scale
        Order of magnitude of c [N s/m]; searched from a thousandth to a hundred times that.
    modes
        Number of the lowest modes that count.
    """
    grid = scale * np.geomspace(1e-3, 1e2, 61)
    values = [lowest_damping(modal, float(c), stiffness, modes) for c in grid]
    best = int(np.argmax(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(
        lambda c: -lowest_damping(modal, float(c), stiffness, modes), bounds=(low, high), method="bounded"
    )
    return float(found.x)


def viscous_for_damping(modal: ModalModel, stiffness: float, ratio: float, scale: float, modes: int = 1) -> float:
    """Return c [N s/m] of every device that gives the lowest modes at least the damping ratio `ratio`.

    If no gain reaches it, the gain of the largest damping is returned.
    """
    best = exact_viscous(modal, stiffness, scale, modes)
    if lowest_damping(modal, best, stiffness, modes) <= ratio:
        return best
    low, high = 0.0, best
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lowest_damping(modal, middle, stiffness, modes) < ratio else (low, middle)
    return high
