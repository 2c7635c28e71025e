"""Frame tests as arrays: what excites, what answers, on which floor."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.errors import UserError

ACCELERATION = "floor_acceleration"
DISPLACEMENT = "floor_displacement"


class Place(NamedTuple):
    """A floor (0 is the ground) and a direction (empty where the campaign has one direction only)."""

    floor: int
    direction: str = ""


class Sensor(NamedTuple):
    """What a sensor measures and where."""

    floor: int
    direction: str
    is_displacement: bool


@dataclass(frozen=True)
class FrameTest:
    """One recorded test of a frame.

    Attributes
    ----------
    name, kind
        As in campaign.yaml; kind is sweep, random or free-decay.
    sampling_rate_hz
        Rate of all channels.
    excitation
        Ground acceleration [m/s2], or shaker force [N] where `shaker_floor` is not 0; shape (m,). None where a decay
        test recorded none.
    responses
        Shape (m, s): absolute acceleration [m/s2] of each measured floor, or its displacement relative to the ground
        [m] where `is_displacement` is true.
    is_displacement
        Shape (s,).
    shaker_floor
        0 for excitation by the base.
    mode
        Mode that a decay test is for, from 1; 0 where it was not told.
    displacements
        Floor (from 1) -> displacement [m], shape (m,), where lasers were there beside accelerometers.
    role
        training, validation or repeat; validation tests are kept for verification where there are others.
    places
        Place of each column of `responses`; empty where column i is floor i + 1.
    further_inputs
        Place and values of the excitations beside the first one.
    direction
        Direction of the first excitation; empty where the campaign has one direction only.
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
        return self.responses.shape[0] / self.sampling_rate_hz


def _floor_numbers(recording: Recording, quantity: str) -> set[int]:
    prefix = f"{quantity}_"
    return {int(key[len(prefix) :]) for key in recording.channels if key.startswith(prefix)}


def _shaker_floor(recording: Recording, source: Path, floors: int) -> int:
    details = recording.details
    named = details.get("floor", details.get("input_force_floor", details.get("shaker_floor")))
    if named is None:
        place = f"tests.{recording.name}.channels.input_force"
        raise UserError(source, place, "does not say on which floor the shaker acts", "add floor: 1 (or another)")
    floor = int(named)
    if not 1 <= floor <= floors:
        place = f"tests.{recording.name}.channels.input_force.floor"
        raise UserError(source, place, f"is {floor}", f"the frame has floors 1 to {floors}")
    return floor


def _cut(recording: Recording) -> slice:
    # tests of a frame are used whole or as one stretch: a modal fit needs an unbroken record
    if not recording.segments:
        return slice(None)
    start, stop = max(recording.segments, key=lambda item: item[1] - item[0])
    return slice(start, stop)


def frame_test(recording: Recording, source: Path, floors: int = 0) -> FrameTest:
    """Return a recording of a frame as arrays.

    Parameters
    ----------
    recording
        With channels floor_acceleration_i or floor_displacement_i and ground_acceleration or input_force.
    source
        campaign.yaml, for messages.
    floors
        Number of floors; 0 takes it from the channels.

    Raises
    ------
    UserError
        If a floor has no channel, or the shaker's floor is not told or is not there.
    """
    accelerations = _floor_numbers(recording, ACCELERATION)
    displacements = _floor_numbers(recording, DISPLACEMENT)
    seen = accelerations | displacements
    n = floors or max(seen, default=0)
    missing = sorted(set(range(1, n + 1)) - seen)
    if missing or not seen:
        place = f"tests.{recording.name}.channels"
        name = f"{ACCELERATION}_{missing[0] if missing else 1}"
        raise UserError(source, place, f"no {name}", "every floor needs its acceleration (or displacement) channel")
    part = _cut(recording)
    is_displacement = tuple(floor not in accelerations for floor in range(1, n + 1))
    names = [f"{DISPLACEMENT if d else ACCELERATION}_{i}" for i, d in enumerate(is_displacement, start=1)]
    responses = np.column_stack([recording.channels[name][part] for name in names])
    shaker = 0
    excitation = recording.channels.get("ground_acceleration")
    if "input_force" in recording.channels:
        shaker = _shaker_floor(recording, source, n)
        excitation = recording.channels["input_force"]
    if excitation is None and recording.kind != "free-decay":
        place = f"tests.{recording.name}.channels"
        raise UserError(source, place, "no ground_acceleration", "add it, or input_force with its floor")
    return FrameTest(
        name=recording.name,
        kind=recording.kind,
        sampling_rate_hz=recording.sampling_rate_hz,
        excitation=None if excitation is None else excitation[part],
        responses=responses,
        is_displacement=is_displacement,
        shaker_floor=shaker,
        mode=int(recording.details.get("mode") or 0),
        role=recording.role,
        displacements=tuple((i, recording.channels[f"{DISPLACEMENT}_{i}"][part]) for i in sorted(displacements)),
    )


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
        Shape (n,) [kg].
    source
        campaign.yaml, for messages.
    """

    forced: tuple[FrameTest, ...]
    decays: tuple[FrameTest, ...]
    floor_masses: FloatArray
    source: Path


def frame_tests(campaign: Campaign) -> FrameTests:
    """Return the forced and decay tests of a frame campaign.

    Raises
    ------
    UserError
        If the rig is no shear-frame, no sweep or random test is there, or the masses are missing, too few or not
        positive.
    """
    source = campaign.directory / "campaign.yaml"
    if campaign.rig != "shear-frame":
        raise UserError(source, "rig", f"is {campaign.rig!r}", "identify-frame needs a campaign of a shear-frame")
    forced_recordings = [item for item in campaign.recordings if item.kind in {"sweep", "random"}]
    if not forced_recordings:
        raise UserError(source, "tests", "no test of kind sweep or random", "mode shapes need a forced test")
    forced = tuple(frame_test(item, source) for item in forced_recordings)
    floors = max(item.floors for item in forced)
    forced = tuple(frame_test(item, source, floors) for item in forced_recordings)
    decays = tuple(frame_test(item, source, floors) for item in campaign.recordings if item.kind == "free-decay")
    masses = np.asarray(campaign.floor_masses_kg, dtype=np.float64)
    place = "frame.floor_masses_kg"
    if masses.size == 0:
        raise UserError(source, place, "is missing", f"give the masses of the {floors} floors in kg")
    if masses.size != floors:
        raise UserError(source, place, f"has {masses.size} entries", f"the channels are of {floors} floors")
    for floor, mass in enumerate(masses, start=1):
        if not (np.isfinite(mass) and mass > 0.0):
            raise UserError(source, place, f"mass of floor {floor} is {mass:g} kg", "give a positive mass in kg")
    return FrameTests(forced, decays, masses, source)
