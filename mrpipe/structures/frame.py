"""Linear structure: result of the identification or of a file, and part of the closed loop."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray
from mrpipe.errors import UserError


@dataclass(frozen=True)
class Frame:
    """Linear structure M x'' + C x' + K x = -w f - M r x_g'' (4.1); x is relative to the ground.

    For a shear frame the degrees of freedom are the floors, floor 1 first, and r is a column of ones.

    Attributes
    ----------
    mass, damping, stiffness
        Shape (n, n); kg, N s/m, N/m for displacements. Rotations have kg m^2 and so on.
    name
        Name of the structure in tables.
    influence
        Displacement of each degree of freedom when the ground moves by 1 m, r, shape (n,) [1]; None: ones.
    degrees_of_freedom
        Names of the degrees of freedom, length n; empty: `floor 1` and so on.
    modal_coordinates
        Number of last coordinates that are amplitudes of modes, as after a Craig-Bampton reduction.
    influence_y
        The same for ground motion in the second direction; None: the structure has one direction.
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    name: str = "frame"
    influence: FloatArray | None = None
    degrees_of_freedom: tuple[str, ...] = ()
    modal_coordinates: int = 0
    influence_y: FloatArray | None = None

    @property
    def floors(self) -> int:
        """Number of degrees of freedom n."""
        return int(self.mass.shape[0])

    @property
    def ground_influence(self) -> FloatArray:
        """Influence vector r of the ground motion, shape (n,)."""
        return np.ones(self.floors) if self.influence is None else self.influence

    def turned(self, degrees: float) -> Frame:
        """Return the same structure with the directions of the ground motion rotated from x towards y.

        Parameters
        ----------
        degrees
            Angle of the first direction from x [degrees].

        Raises
        ------
        UserError
            If the structure has no second direction.
        """
        if degrees == 0.0:
            return self
        if self.influence_y is None:
            raise UserError(
                "simulate.excitation",
                "direction_deg",
                f"is {degrees:g}, but the structure has no second direction",
                "give structure.influence_y",
            )
        # the cosine of 90 degrees is not exactly zero in radians
        turn = np.round(np.exp(1j * np.radians(degrees)), 15)
        x, y = self.ground_influence, self.influence_y
        return replace(self, influence=turn.real * x + turn.imag * y, influence_y=turn.real * y - turn.imag * x)

    @property
    def moved_by_ground(self) -> tuple[int, ...]:
        """Indices of the degrees of freedom that move with the ground, in their order.

        Results call the first of them the first floor and the last one the top. In a frame with torsion these are the
        translations in the direction of the ground motion, so that no rotation is given in metres. With a second
        direction, a degree of freedom belongs to the first one if it is turned from it by less than 45 degrees (at
        45 degrees to one of the two, so that drifts are never taken between directions). Modal coordinates are left
        out, because they do not belong to a place.
        """
        places = self.floors - self.modal_coordinates
        along = self.ground_influence[:places]
        across = np.zeros(places) if self.influence_y is None else self.influence_y[:places]
        size, rounding = np.abs(along), 1e-9 * float(np.max(np.abs(along), initial=0.0))
        nearer = size - np.abs(across) > rounding
        between = np.abs(size - np.abs(across)) <= rounding
        found = np.flatnonzero((size > 1e3 * rounding) & (nearer | (between & (along * across <= 0.0))))
        return tuple(int(index) for index in found) or tuple(range(self.floors))

    @property
    def top(self) -> int:
        """Index of the top: the last degree of freedom that moves with the ground."""
        return self.moved_by_ground[-1]

    def place_of(self, sensor: str) -> int | None:
        """Return the degree of freedom that a floor sensor measures; None if the frame has none.

        Parameters
        ----------
        sensor
            Floor and direction as in the name of the channel: `3` of `floor_displacement_3`, `3_y` of
            `floor_displacement_3_y`. A floor without a direction is counted among :attr:`moved_by_ground`.
        """
        floor, _, direction = sensor.partition("_")
        name = f"floor {floor} {direction}".strip()
        if name in self.names:
            return self.names.index(name)
        counted = self.moved_by_ground
        return counted[int(floor) - 1] if not direction and int(floor) <= len(counted) else None

    @property
    def ground_masses(self) -> FloatArray:
        """Force on the ground per unit absolute acceleration of each degree of freedom, r' M, shape (n,) [kg]."""
        return self.ground_masses_of(self.ground_influence)

    def ground_masses_of(self, influence: FloatArray) -> FloatArray:
        """Return M' r for an influence vector r, shape (n,)."""
        return np.asarray(self.mass.T @ influence)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self.degrees_of_freedom or tuple(f"floor {k + 1}" for k in range(self.floors))


_MATRICES = {"mass": "kg", "damping": "N*s/m", "stiffness": "N/m"}


def write_frame(artifact: ArtifactWriter, frame: Frame, group: str = "frame") -> None:
    """Write the matrices of a frame, and its influence vector and names if they differ from the defaults."""
    for name, unit in _MATRICES.items():
        artifact.put(f"{group}/{name}", getattr(frame, name), unit=unit, dims=("floor", "floor_of_cause"))
    if frame.influence is not None:
        artifact.put(f"{group}/influence", frame.influence, unit="1", dims=("floor",))
    if frame.influence_y is not None:
        artifact.put(f"{group}/influence_y", frame.influence_y, unit="1", dims=("floor",))
    if frame.degrees_of_freedom:
        artifact.put_json(f"{group}/degrees_of_freedom", list(frame.degrees_of_freedom))
    artifact.attributes(group, name=frame.name)
    if frame.modal_coordinates:
        artifact.attributes(group, modal_coordinates=frame.modal_coordinates)


def read_frame(artifact: Artifact, group: str = "frame") -> Frame:
    """Read the frame that :func:`write_frame` wrote.

    Raises
    ------
    UserError
        If the artifact holds modes but no matrices.
    """
    if f"{group}/mass" not in artifact:
        remedy = "give frame.floor_masses_kg in campaign.yaml and run mrpipe identify-frame again"
        raise UserError(artifact.path, group, "is missing: the data determine modes but no matrices", remedy)
    members = set(artifact.members(group))
    names = artifact.json(f"{group}/degrees_of_freedom") if "degrees_of_freedom" in members else []
    return Frame(
        **{name: artifact.array(f"{group}/{name}") for name in _MATRICES},
        name=str(artifact.attributes(group)["name"]),
        influence=artifact.array(f"{group}/influence") if "influence" in members else None,
        degrees_of_freedom=tuple(str(name) for name in names),
        modal_coordinates=int(artifact.attributes(group).get("modal_coordinates", 0)),
        influence_y=artifact.array(f"{group}/influence_y") if "influence_y" in members else None,
    )
