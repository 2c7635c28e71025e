"""A benchmark structure: matrices, how loads and devices act on it, and its modal form."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.linalg import eigh

from mrpipe.artifacts import FloatArray
from mrpipe.structures import Frame
from mrpipe.structures.given import structure_from_settings
from mrpipe.structures.given_storage import read_matrix
from mrpipe.structures.options import MatrixEntry, StructureSettings

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
        A sentence that says where the numbers come from.
    frame
        Mass, damping and stiffness, and how the ground moves the structure, as every structure of the program.
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
    frame: Frame
    load: FloatArray
    devices: FloatArray
    total_mass_kg: float
    notes: dict[str, float] = field(default_factory=dict)

    @property
    def mass(self) -> FloatArray:
        """M, shape (n, n), SI."""
        return self.frame.mass

    @property
    def damping(self) -> FloatArray:
        """C, shape (n, n), SI."""
        return self.frame.damping

    @property
    def stiffness(self) -> FloatArray:
        """K, shape (n, n), SI."""
        return self.frame.stiffness

    @property
    def degrees_of_freedom(self) -> int:
        """Number of degrees of freedom n."""
        return int(self.mass.shape[0])

    def with_devices(self, devices: FloatArray) -> BenchmarkModel:
        """Return the same structure with its devices elsewhere, shape (n, k)."""
        return replace(self, devices=np.asarray(devices, dtype=np.float64))


def ground_load(frame: Frame) -> FloatArray:
    """Return G of the accelerations of the ground in the one or two directions of a structure, shape (n, m) [kg]."""
    directions = [frame.ground_influence] + ([] if frame.influence_y is None else [frame.influence_y])
    return np.asarray(-frame.mass @ np.column_stack(directions))


def published_frame(path: Path, name: str, mass: str, damping: str, stiffness: str) -> Frame:
    """Return the structure of a published model, read as the section `structure` of the settings reads one.

    Parameters
    ----------
    path
        The file.
    name
        Name of the structure.
    mass, damping, stiffness
        Variables of the file, in t, kN s/m and kN/m.

    Raises
    ------
    UserError
        If the file is not there, holds no such matrices, or they are not those of a structure.
    """
    settings = StructureSettings(
        file=str(path),
        mass=MatrixEntry(name=mass, unit="t"),
        damping=MatrixEntry(name=damping, unit="kN*s/m"),
        stiffness=MatrixEntry(name=stiffness, unit="kN/m"),
    )
    return structure_from_settings(settings, read_matrix, name)


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
        Number of modes that are kept, from the lowest; None: all.
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
