"""Modes, state space and exact steps of a frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from mrpipe.artifacts import FloatArray
from mrpipe.structures.frame import Frame

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class NaturalModes:
    """Undamped modes in ascending order of frequency.

    Attributes
    ----------
    angular_frequencies
        Shape (n,) [rad/s]; NaN for a negative squared frequency (unstable mode).
    mode_shapes
        Shape (n, n), one row per floor and one column per mode, U'MU = I [1/sqrt(kg)]; the top floor is positive in the
        first mode.
    """

    angular_frequencies: FloatArray
    mode_shapes: FloatArray

    @property
    def frequencies_hz(self) -> FloatArray:
        """Natural frequencies [Hz]."""
        return np.asarray(self.angular_frequencies / (2.0 * np.pi))


@dataclass(frozen=True)
class ComplexModes:
    """Damped modes, one of each conjugate pair, in ascending order of |s|; overdamped (real) modes are last.

    Attributes
    ----------
    poles
        Shape (m,) complex [rad/s]; s = -zeta omega + i omega_d. A real pole counts as a separate mode.
    mode_shapes
        Shape (n, m) complex, displacement part, largest element 1.
    """

    poles: ComplexArray
    mode_shapes: ComplexArray

    @property
    def angular_frequencies(self) -> FloatArray:
        """|s| [rad/s]."""
        return np.asarray(np.abs(self.poles))

    @property
    def damping_ratios(self) -> FloatArray:
        """Damping ratios -Re s/|s| [1]; negative if the mode grows."""
        return np.asarray(-self.poles.real / np.maximum(np.abs(self.poles), 1e-300))


@dataclass(frozen=True)
class StateSpace:
    """State space z' = A z + B u with z = [x, v] relative to the ground, u = [ground acceleration, force 1, ...].

    Attributes
    ----------
    A, B
        Shape (2n, 2n), (2n, 1 + k).
    """

    A: FloatArray
    B: FloatArray

    @property
    def floors(self) -> int:
        """Number of floors n."""
        return int(self.A.shape[0] // 2)

    def absolute_acceleration(self) -> tuple[FloatArray, FloatArray]:
        """Return C (n, 2n) and D (n, 1 + k) of the absolute accelerations x'' + x_g'' = C z + D u.

        The ground acceleration cancels, because M (x'' + r x_g'') = f - C x' - K x.
        """
        n = self.floors
        D = self.B[n:].copy()
        D[:, 0] = 0.0
        return self.A[n:].copy(), D


def natural_modes(frame: Frame) -> NaturalModes:
    """Return the undamped modes of (K - omega2 M) u = 0 (4.4), unit modal mass.

    A stiffness matrix with rounding errors in its symmetry, such as that of (3.16), is symmetrised.
    """
    squared, shapes = eigh(0.5 * (frame.stiffness + frame.stiffness.T), frame.mass)
    signs = np.where(shapes[-1] < 0.0, -1.0, 1.0)
    omega = np.full(squared.shape, np.nan)
    omega[squared >= 0.0] = np.sqrt(squared[squared >= 0.0])
    return NaturalModes(omega, np.asarray(shapes * signs))


def normalise_to_largest(mode_shapes: FloatArray) -> FloatArray:
    """Return shapes (n, m) whose element of largest magnitude in each column is +1, as (3.5) prints them."""
    shapes = np.asarray(mode_shapes, dtype=np.float64)
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None, :], axis=0)
    return np.asarray(shapes / largest)


def floor_position(floors: int, floor: int = 1) -> FloatArray:
    """Return the connectivity vector w of (4.1), shape (n,): a device between ground and `floor` (from 1)."""
    position = np.zeros(floors)
    position[floor - 1] = 1.0
    return position


def storey_position(floors: int, storey: int) -> FloatArray:
    """Return w, shape (n,), of a device across `storey` (1 is between ground and floor 1): drift x_s - x_(s-1)."""
    position = floor_position(floors, storey)
    if storey > 1:
        position[storey - 2] = -1.0
    return position


def state_space(frame: Frame, force_positions: ArrayLike | None = None) -> StateSpace:
    """Return the state space of (3.12) with ground acceleration and forces as inputs.

    Parameters
    ----------
    frame
        The structure.
    force_positions
        Shape (n, k), one column per force that acts on the floors [1]; None: no forces. A resisting damper force f
        (4.1) has the column -w.
    """
    n = frame.floors
    inverse = np.linalg.inv(frame.mass)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -inverse @ frame.stiffness
    A[n:, n:] = -inverse @ frame.damping
    columns = [-frame.ground_influence[:, None]]
    if force_positions is not None:
        columns.append(inverse @ np.asarray(force_positions, dtype=np.float64).reshape(n, -1))
    B = np.vstack([np.zeros((n, sum(c.shape[1] for c in columns))), np.hstack(columns)])
    return StateSpace(A, B)


def complex_modes(
    frame: Frame, *, position: ArrayLike | None = None, stiffness: float = 0.0, damping: float = 0.0
) -> ComplexModes:
    """Return the damped modes, optionally with a linear device f = damping v + stiffness x at `position`.

    Parameters
    ----------
    frame
        The structure.
    position
        Connectivity vector w, shape (n,); None: floor 1 to ground.
    stiffness, damping
        Stiffness [N/m] and viscosity [N s/m] of the device.
    """
    w = floor_position(frame.floors) if position is None else np.asarray(position, dtype=np.float64)
    device = np.outer(w, w)
    with_device = replace(
        frame, damping=frame.damping + damping * device, stiffness=frame.stiffness + stiffness * device
    )
    poles, vectors = np.linalg.eig(state_space(with_device).A)
    keep = poles.imag >= -1e-12 * np.abs(poles)
    poles, shapes = poles[keep], vectors[: frame.floors, keep]
    order = np.lexsort((np.abs(poles), poles.imag <= 1e-9 * np.abs(poles)))
    poles, shapes = poles[order], shapes[:, order]
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None, :], axis=0)
    return ComplexModes(np.asarray(poles, dtype=np.complex128), np.asarray(shapes / largest, dtype=np.complex128))


def frequency_response(
    frame: Frame, omega: ArrayLike, *, shaker_floor: int = 0, absolute_acceleration: bool = True
) -> ComplexArray:
    """Return the frequency response of every floor, shape (number of frequencies, n).

    Parameters
    ----------
    frame
        The structure.
    omega
        Shape (m,) [rad/s].
    shaker_floor
        0: the input is the ground acceleration; otherwise a force on the floor with this number.
    absolute_acceleration
        Whether the output is the absolute acceleration ([1] or [1/kg]); otherwise the output is the displacement
        relative to the ground ([s^2] or [m/N]).
    """
    w = np.atleast_1d(np.asarray(omega, dtype=np.float64))
    n = frame.floors
    load = -frame.mass @ frame.ground_influence if shaker_floor == 0 else floor_position(n, shaker_floor)
    dynamic = frame.stiffness + 1j * w[:, None, None] * frame.damping - w[:, None, None] ** 2 * frame.mass
    relative = np.linalg.solve(dynamic, np.broadcast_to(load.astype(np.complex128)[:, None], (w.size, n, 1)))[..., 0]
    if not absolute_acceleration:
        return np.asarray(relative)
    ground = frame.ground_influence if shaker_floor == 0 else np.zeros(n)
    return np.asarray(ground - w[:, None] ** 2 * relative)


def modal_assurance(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Return the modal assurance criterion, shape (m1, m2), of shapes (n, m1) and (n, m2), real or complex."""
    a = np.asarray(first)
    b = np.asarray(second)
    cross = np.abs(a.conj().T @ b) ** 2
    norms = np.outer(np.sum(np.abs(a) ** 2, axis=0), np.sum(np.abs(b) ** 2, axis=0))
    return np.asarray(cross / norms, dtype=np.float64)
