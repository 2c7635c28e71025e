"""Exact complex eigenvalues of a structure with several linear devices, each with or without a brace in series."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrpipe.artifacts import FloatArray
from mrpipe.control.exact import CRITICAL
from mrpipe.control.following import followed_pole
from mrpipe.control.gains import Gains
from mrpipe.control.law import Law
from mrpipe.control.limits import equal_frequencies
from mrpipe.control.linearisation import clipped_linear_stiffness, equivalent_stiffness
from mrpipe.structures import Frame, natural_modes

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class LinearDevice:
    """Device f = c v + (k + H) x, where x is the displacement of the device without that of its brace.

    Attributes
    ----------
    position
        Connectivity vector w of brace and device together, shape (n,).
    viscosity, stiffness
        c [N s/m] and k [N/m].
    equivalent
        H [N/m], a complex stiffness that does not depend on frequency.
    brace_n_m
        Stiffness of the brace in series with the device [N/m]; infinite: rigid.
    """

    position: FloatArray
    viscosity: float = 0.0
    stiffness: float = 0.0
    equivalent: complex = 0.0
    brace_n_m: float = math.inf

    @property
    def has_state(self) -> bool:
        """Whether the displacement of the device is a state, because brace and viscosity are in series."""
        return self.viscosity > 0.0 and not math.isinf(self.brace_n_m)

    def scaled(self, share: float) -> LinearDevice:
        """Return the device with its force multiplied by `share` and the same brace."""
        return replace(
            self,
            viscosity=share * self.viscosity,
            stiffness=share * self.stiffness,
            equivalent=share * self.equivalent,
        )

    def dynamic_stiffness(self, s: complex) -> complex:
        """Return the complex stiffness [N/m] of device and brace at the Laplace variable s [rad/s]."""
        own = self.stiffness + self.equivalent + s * self.viscosity
        return own if math.isinf(self.brace_n_m) else own * self.brace_n_m / (own + self.brace_n_m)


def linear_device(
    law: Law, gains: Gains, position: FloatArray, omega: float, amplitude_m: float, brace_n_m: float = math.inf
) -> LinearDevice | None:
    """Return the linear equivalent of a device under a law; None if the law has none.

    A linear law without negative stiffness is equal to its equivalent. A clipped law, and every other law with a known
    force in harmonic motion, is replaced by its first harmonic at `omega` and `amplitude_m`.

    Parameters
    ----------
    law, gains
        Control law of the device and its gains.
    position
        Connectivity vector, shape (n,).
    omega, amplitude_m
        Angular frequency [rad/s] and amplitude [m] of the harmonic motion.
    brace_n_m
        Stiffness of the brace [N/m].
    """
    if law.linear and gains.k_n_m >= 0.0:
        return LinearDevice(position, gains.c_n_s_m, gains.k_n_m, brace_n_m=brace_n_m)
    if law.linear:
        equivalent = clipped_linear_stiffness(gains.c_n_s_m, gains.k_n_m, omega)
        return LinearDevice(position, equivalent=equivalent, brace_n_m=brace_n_m)
    if law.harmonic_force is None:
        return None
    force = law.harmonic_force
    equivalent = equivalent_stiffness(lambda x, v: force(gains, x, v, amplitude_m), amplitude_m, omega)
    return LinearDevice(position, equivalent=equivalent, brace_n_m=brace_n_m)


def loop_matrix(frame: Frame, devices: Sequence[LinearDevice]) -> ComplexArray:
    """Return A of z' = A z; z is [x, v] and the displacement of each device with viscosity in series with a brace.

    With a brace of stiffness k_b the force is k_b (w'x - x_d) = c x_d' + (k + H) x_d. A device without viscosity is in
    series with its brace, so that its stiffness is (k + H) k_b/(k + H + k_b).
    """
    n = frame.floors
    stiffness = frame.stiffness.astype(np.complex128)
    damping = frame.damping.copy()
    hidden = [item for item in devices if item.has_state]
    for item in devices:
        outer = np.outer(item.position, item.position)
        if item.has_state:
            stiffness = stiffness + item.brace_n_m * outer
        else:
            stiffness = stiffness + item.dynamic_stiffness(0.0) * outer
            damping = damping + item.viscosity * outer
    size = 2 * n + len(hidden)
    inverse = np.linalg.inv(frame.mass)
    A = np.zeros((size, size), dtype=np.complex128)
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -inverse @ stiffness
    A[n : 2 * n, n : 2 * n] = -inverse @ damping
    for row, item in enumerate(hidden, start=2 * n):
        A[n : 2 * n, row] = inverse @ item.position * item.brace_n_m
        A[row, :n] = item.brace_n_m * item.position / item.viscosity
        A[row, row] = -(item.brace_n_m + item.stiffness + item.equivalent) / item.viscosity
    return A


@dataclass(frozen=True)
class TogetherDamping:
    """Target modes of a structure with all its devices.

    Attributes
    ----------
    poles
        Eigenvalue s of each target mode, shape (m,) [rad/s].
    growth_1_s
        Largest real part of all eigenvalues [1/s].
    slowest_1_s
        Smallest decay rate of a motion without oscillation [1/s]; infinite if there is no such motion.
    free_rad_s
        Angular frequency of each target mode without devices, shape (m,) [rad/s].
    """

    poles: ComplexArray
    growth_1_s: float
    slowest_1_s: float
    free_rad_s: FloatArray

    @property
    def stable(self) -> bool:
        """Whether no mode grows."""
        return self.growth_1_s < 1e-9

    @property
    def damping_ratios(self) -> FloatArray:
        """Damping ratio -Re s/|s| of each target mode, shape (m,); -1 for all if a mode grows."""
        ratios = np.asarray(-self.poles.real / np.maximum(np.abs(self.poles), 1e-300))
        return ratios if self.stable else np.full(ratios.shape, -1.0)

    @property
    def effective_ratios(self) -> FloatArray:
        """Damping ratio of each target mode, shape (m,); of an overdamped mode its decay rate over its frequency.

        The damping ratio of a real pole is 1, however slowly the mode returns. Its effective damping ratio is the
        smallest decay rate of a motion without oscillation over the angular frequency without devices, at most 1. For a
        single degree of freedom with a dashpot this is zeta - sqrt(zeta^2 - 1).
        """
        ratios = self.damping_ratios
        slow = np.minimum(1.0, self.slowest_1_s / self.free_rad_s)
        return np.where(ratios >= CRITICAL, slow, ratios)


def damping_together(frame: Frame, devices: Sequence[LinearDevice], modes: Sequence[int]) -> TogetherDamping:
    """Follow the eigenvalues of the target modes while all devices increase from zero together.

    Parameters
    ----------
    frame
        The structure.
    devices
        Linear devices, with connectivity vectors of shape (n,).
    modes
        Numbers of the target modes, from 1.
    """
    omega, slopes = natural_modes(frame).angular_frequencies, _slopes(frame, devices)

    @functools.cache
    def upper(share: float) -> ComplexArray:
        # a device in series with its brace has an infinite eigenvalue at share 0
        matrix = loop_matrix(frame, [item.scaled(max(share, 1e-9)) for item in devices])
        eigenvalues = np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)
        # the equivalents are valid at positive frequencies, so that only eigenvalues in the upper half plane are used
        return eigenvalues[eigenvalues.imag >= -1e-9 * np.abs(eigenvalues)]

    poles = [followed_pole(upper, complex(0.0, omega[mode - 1]), slopes[mode - 1]) for mode in modes]
    rates = -upper(1.0).real
    real = rates[rates >= CRITICAL * np.abs(upper(1.0))]
    return TogetherDamping(
        poles=np.array(poles, dtype=np.complex128),
        growth_1_s=float(-np.min(rates)),
        slowest_1_s=float(np.min(real)) if real.size else math.inf,
        free_rad_s=np.array([omega[mode - 1] for mode in modes]),
    )


def _slopes(frame: Frame, devices: Sequence[LinearDevice]) -> list[complex]:
    """Return the first-order change of the pole of each mode by all devices [rad/s].

    Modes of the same frequency are those combinations of their shapes that the devices do not couple.
    """
    found = natural_modes(frame)
    slopes = []
    for group in equal_frequencies(found.angular_frequencies):
        shapes, s = found.mode_shapes[:, group], complex(0.0, found.angular_frequencies[group[0]])
        strokes = np.array([item.position @ shapes for item in devices]).reshape(len(devices), len(group))
        own = np.array([item.stiffness + item.equivalent + s * item.viscosity for item in devices])
        values, vectors = np.linalg.eig(strokes.T @ (own[:, None] * strokes))
        nearest = np.argmax(np.abs(vectors), axis=0)
        in_order = np.argsort(nearest) if len(set(nearest)) == len(group) else np.argsort(-np.abs(values))
        slopes += [-complex(value) / (2.0 * s) for value in values[in_order]]
    return slopes


def ground_response(frame: Frame, devices: Sequence[LinearDevice], omega: float) -> tuple[ComplexArray, ComplexArray]:
    """Return the displacements [m] of floors (n,) and devices (k,) for a ground acceleration of 1 m/s^2.

    Parameters
    ----------
    frame, devices
        Structure and its devices.
    omega
        Frequency of the harmonic ground motion [rad/s].
    """
    s = 1j * omega
    dynamic = frame.stiffness + s * frame.damping - omega**2 * frame.mass
    stiffness = [item.dynamic_stiffness(s) for item in devices]
    for item, value in zip(devices, stiffness, strict=True):
        dynamic = dynamic + value * np.outer(item.position, item.position)
    floors = np.linalg.solve(dynamic, -(frame.mass @ frame.ground_influence).astype(np.complex128))
    strokes = [
        item.position @ floors * (1.0 if math.isinf(item.brace_n_m) else 1.0 - value / item.brace_n_m)
        for item, value in zip(devices, stiffness, strict=True)
    ]
    return np.asarray(floors), np.asarray(strokes, dtype=np.complex128)
