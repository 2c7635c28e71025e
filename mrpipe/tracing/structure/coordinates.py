"""What spectra of a structure refer to: a band of frequencies, the frame of their weights, and modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray


@dataclass(frozen=True)
class Band:
    """Frequencies that are compared [Hz]."""

    low_hz: float
    high_hz: float


@dataclass(frozen=True)
class Weighting:
    """Linear frame by which the noise of the sensors is propagated to the equations of the storeys.

    Attributes
    ----------
    stiffness
        Shear of each storey per floor displacement, shape (n, n) [N/m].
    ground
        Shear of each storey per ground acceleration, and per its second derivative over the square of the highest
        angular frequency in use, shape (n, 2) [kg]; zero for a frame whose modes are all in the band.
    turning
        Shear of each storey per rotation of each floor about the vertical, shape (n, turns) [N/rad].
    """

    stiffness: FloatArray
    ground: FloatArray
    turning: FloatArray

    @classmethod
    def of_displacements(cls, stiffness: FloatArray, turns: int = 0) -> Weighting:
        """Return the weighting of a frame whose forces depend on the displacements alone, not on rotations."""
        return cls(stiffness, np.zeros((len(stiffness), 2)), np.zeros((len(stiffness), turns)))


@dataclass(frozen=True)
class Modes:
    """Modes of a structure that its records determine, normalised by the masses.

    Attributes
    ----------
    filters
        Modal coordinate of each mode per displacement of each floor, shape (m, n).
    equations
        Equation of motion of each mode as a sum of those of the storeys, shape (m, n).
    forces
        Shear force of each storey per modal force, shape (n, m).
    """

    filters: FloatArray
    equations: FloatArray
    forces: FloatArray
