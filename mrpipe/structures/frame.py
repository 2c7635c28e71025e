"""A structure with lumped masses: what identification finds and the closed loop shakes."""

from __future__ import annotations

from dataclasses import dataclass

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray


@dataclass(frozen=True)
class Frame:
    """M x'' + C x' + K x = -w f - M 1 x_g'' (4.1); floor 1 first.

    Attributes
    ----------
    mass, damping, stiffness
        Shape (n, n); kg, N s/m, N/m.
    name
        For tables.
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    name: str = "frame"

    @property
    def floors(self) -> int:
        """Number of floors n."""
        return int(self.mass.shape[0])


_MATRICES = {"mass": "kg", "damping": "N*s/m", "stiffness": "N/m"}


def write_frame(artifact: ArtifactWriter, frame: Frame, group: str = "frame") -> None:
    """Write the matrices of a frame."""
    for name, unit in _MATRICES.items():
        artifact.put(f"{group}/{name}", getattr(frame, name), unit=unit, dims=("floor", "floor_of_cause"))
    artifact.attributes(group, name=frame.name)


def read_frame(artifact: Artifact, group: str = "frame") -> Frame:
    """Read what :func:`write_frame` wrote."""
    return Frame(
        **{name: artifact.array(f"{group}/{name}") for name in _MATRICES},
        name=str(artifact.attributes(group)["name"]),
    )
