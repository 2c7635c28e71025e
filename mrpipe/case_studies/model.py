"""A benchmark structure: matrices, how loads and devices act on it, and its modal form."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.linalg import eigh

from mrpipe.artifacts import FloatArray

Origin = Literal["published", "surrogate"]


@dataclass(frozen=True)
class BenchmarkModel:
    """M x'' + C x' + K x = G w - P f, x relative to the ground unless said otherwise.

    Attributes
    ----------
    name
        `ten-storey`, `base-isolated` or `wind`.
    origin
        `published` (read from its file) or `surrogate` (assembled by our own code from published facts).
    source
        Where the numbers come from, in a sentence.
    mass, damping, stiffness
        Shape (n, n), SI.
    load
        G, shape (n, m): [kg] for ground accelerations, [1] for forces.
    devices
        P, shape (n, k): a column a device; its rod moves by P'x [m] and its resisting force f acts as -P f.
    total_mass_kg
        Translational mass in one direction.
    notes
        Further facts for tables.
    """

    name: str
    origin: Origin
    source: str
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    load: FloatArray
    devices: FloatArray
    total_mass_kg: float
    notes: dict[str, float] = field(default_factory=dict)

    @property
    def degrees_of_freedom(self) -> int:
        """Number of degrees of freedom n."""
        return int(self.mass.shape[0])

    def with_devices(self, devices: FloatArray) -> BenchmarkModel:
        """Return the same structure with its devices elsewhere, shape (n, k)."""
        return replace(self, devices=np.asarray(devices, dtype=np.float64))


@dataclass(frozen=True)
class ModalModel:
    """q'' + D q' + diag(omega^2) q = G w - P f with x = shapes q, all or the first few undamped modes.

    Attributes
    ----------
    angular_frequencies
        Shape (n,) [rad/s].
    shapes
        Shape (dof, n) [1/sqrt(kg)], unit modal mass.
    damping
        D, shape (n, n) [1/s].
    load
        Shape (n, m).
    devices
        Shape (n, k).
    """

    angular_frequencies: FloatArray
    shapes: FloatArray
    damping: FloatArray
    load: FloatArray
    devices: FloatArray

    @property
    def modes(self) -> int:
        """Number of modes n."""
        return len(self.angular_frequencies)

    @property
    def classical(self) -> bool:
        """Whether damping does not couple the modes (to a millionth of its size)."""
        coupled = self.damping - np.diag(np.diag(self.damping))
        return float(np.abs(coupled).max(initial=0.0)) <= 1e-6 * float(np.abs(self.damping).max(initial=0.0))

    @property
    def damping_ratios(self) -> FloatArray:
        """Diagonal damping ratios [1], shape (n,)."""
        return np.asarray(np.diag(self.damping) / (2.0 * self.angular_frequencies))

    def state_matrix(self) -> FloatArray:
        """Return A of z' = A z with z = [q, q'], shape (2n, 2n)."""
        n = self.modes
        A = np.zeros((2 * n, 2 * n))
        A[:n, n:] = np.eye(n)
        A[n:, :n] = -np.diag(self.angular_frequencies**2)
        A[n:, n:] = -self.damping
        return A

    def input_matrix(self, columns: FloatArray) -> FloatArray:
        """Return B of modal forces, shape (2n, c), of columns (n, c)."""
        return np.vstack([np.zeros_like(columns), columns])


def modal_model(model: BenchmarkModel, modes: int | None = None) -> ModalModel:
    """Return the modal form of a structure.

    Parameters
    ----------
    model
        The structure.
    modes
        How many modes are kept, from the lowest; all if left out.
    """
    squared, shapes = eigh(0.5 * (model.stiffness + model.stiffness.T), 0.5 * (model.mass + model.mass.T))
    count = len(squared) if modes is None else min(modes, len(squared))
    shapes = shapes[:, :count]
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None, :], axis=0)
    shapes = shapes * np.sign(largest)
    damping = shapes.T @ model.damping @ shapes
    return ModalModel(
        angular_frequencies=np.sqrt(np.maximum(squared[:count], 0.0)),
        shapes=shapes,
        damping=np.asarray(0.5 * (damping + damping.T)),
        load=np.asarray(shapes.T @ model.load),
        devices=np.asarray(shapes.T @ model.devices),
    )


def natural_periods(model: BenchmarkModel) -> FloatArray:
    """Return the undamped periods [s], longest first, shape (n,)."""
    squared = eigh(model.stiffness, model.mass, eigvals_only=True)
    return np.asarray(2.0 * np.pi / np.sqrt(squared))
