"""Frame tests as arrays: excitations and responses, and the floor of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mrpipe.artifacts import FloatArray


class Place(NamedTuple):
    """A floor (0 is the ground) and a direction (empty if the campaign has one direction only)."""

    floor: int
    direction: str = ""


class Sensor(NamedTuple):
    """Position and quantity of a sensor."""

    floor: int
    direction: str
    is_displacement: bool


@dataclass(frozen=True)
class FrameTest:
    """One recorded test of a frame.

    Attributes
    ----------
    name, kind
        As in campaign.yaml; kind is sweep, random, ambient or free-decay.
    sampling_rate_hz
        Rate of all channels.
    excitation
        Ground acceleration [m/s2], or shaker force [N] where `shaker_floor` is not 0; shape (m,). None where it was
        not measured.
    responses
        Shape (m, s): absolute acceleration [m/s2] of each measured floor, or its displacement relative to the ground
        [m] where `is_displacement` is true.
    is_displacement
        Shape (s,).
    shaker_floor
        0 for excitation by the base.
    mode
        Mode of a decay test, from 1; 0 if the campaign does not state it.
    displacements
        Floor (from 1) and displacement [m], shape (m,), for floors with a laser in addition to accelerometers.
    role
        training, validation or repeat; validation tests are kept for verification if other tests exist.
    places
        Place of each column of `responses`; empty: column i is floor i + 1.
    further_inputs
        Place and values of the further excitations.
    direction
        Direction of the first excitation; empty if the campaign has one direction only.
    added_masses
        Floor (from 1) and known mass [kg] that was added to it in this test.
    note
        A note for the user on the part that is used; empty for none.
    is_clipped
        Whether a sensor reached its limit.
    is_part
        Whether the record begins in the middle of a recording, so that the structure moves at its first sample.
    """

    name: str
    kind: str
    sampling_rate_hz: float
    excitation: FloatArray | None
    responses: FloatArray
    is_displacement: tuple[bool, ...]
    shaker_floor: int = 0
    mode: int = 0
    displacements: tuple[tuple[int, FloatArray], ...] = ()
    role: str = "training"
    places: tuple[Place, ...] = ()
    further_inputs: tuple[tuple[Place, FloatArray], ...] = ()
    direction: str = ""
    added_masses: tuple[tuple[int, float], ...] = ()
    note: str = ""
    is_clipped: bool = False
    is_part: bool = False

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """Place and kind of each column of `responses`."""
        places = self.places or tuple(Place(floor) for floor in range(1, self.responses.shape[1] + 1))
        return tuple(Sensor(*place, flag) for place, flag in zip(places, self.is_displacement, strict=True))

    @property
    def inputs(self) -> dict[Place, FloatArray]:
        """Measured excitations, each of shape (m,), and where they act."""
        first = {} if self.excitation is None else {Place(self.shaker_floor, self.direction): self.excitation}
        return {**first, **dict(self.further_inputs)}

    @property
    def floors(self) -> int:
        """Highest floor with a sensor."""
        return max(sensor.floor for sensor in self.sensors)

    @property
    def duration_s(self) -> float:
        """Length of the test [s]."""
        return float(self.responses.shape[0] / self.sampling_rate_hz)


@dataclass(frozen=True)
class FrameTests:
    """The tests of a frame campaign that identification uses.

    Attributes
    ----------
    forced
        Sweep and random tests.
    decays
        Free-decay tests.
    floor_masses
        Shape (n,) [kg]; nan where unknown.
    source
        campaign.yaml, for messages.
    ambient
        Tests whose excitation was not measured.
    with_added_masses
        Forced and ambient tests with known added masses. They give the scale of the modes of the other tests.
    positions
        Direction of a sensor -> its x and y on the floor [m]; empty where floors move in one direction only.
    inertias
        Shape (n,) [kg m^2]: moment of inertia of each floor about the origin of the positions; empty where unknown.
    part_notes
        Notes for the user on tests that were divided at gaps of their clock, one line for each test.
    """

    forced: tuple[FrameTest, ...]
    decays: tuple[FrameTest, ...]
    floor_masses: FloatArray
    source: Path
    ambient: tuple[FrameTest, ...] = ()
    with_added_masses: tuple[FrameTest, ...] = ()
    positions: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    inertias: FloatArray = field(default_factory=lambda: np.empty(0))
    part_notes: tuple[str, ...] = ()

    @property
    def notes(self) -> list[str]:
        """What the user should know of the parts of the tests that are used."""
        every = (*self.forced, *self.ambient, *self.decays, *self.with_added_masses)
        return [*self.part_notes, *(f"test {test.name}: {test.note}" for test in every if test.note)]
