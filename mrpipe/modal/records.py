"""Frame tests as arrays: excitations and responses, and the floor of each."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.checks import clipped_share
from mrpipe.campaigns.clock import longest_part
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.parts import in_unbroken_parts
from mrpipe.errors import UserError
from mrpipe.modal.declared import check_masses, floor_plan

ACCELERATION = "floor_acceleration"
DISPLACEMENT = "floor_displacement"


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


_FLOOR_CHANNEL = re.compile(r"^(floor_acceleration|floor_displacement)_([1-9][0-9]*)(?:_([a-z][a-z0-9]*))?$")
_GROUND_CHANNEL = re.compile(r"^ground_acceleration(?:_([a-z][a-z0-9]*))?$")
_FORCE_CHANNEL = re.compile(r"^input_force(?:_([a-z0-9]+))?$")


def is_input(name: str) -> bool:
    """Return whether a channel is a measured excitation."""
    return bool(_FORCE_CHANNEL.match(name) or _GROUND_CHANNEL.match(name))


def _sensors(recording: Recording) -> dict[Sensor, str]:
    """Return the sensors of a recording and their channels; a displacement only without an accelerometer."""
    found: dict[Sensor, str] = {}
    for name in recording.channels:
        match = _FLOOR_CHANNEL.match(name)
        if match:
            found[Sensor(int(match.group(2)), match.group(3) or "", match.group(1) == DISPLACEMENT)] = name
    return {
        sensor: name
        for sensor, name in sorted(found.items())
        if not (sensor.is_displacement and sensor._replace(is_displacement=False) in found)
    }


def _shaker_floor(recording: Recording, channel: str, source: Path, floors: int) -> int:
    details = recording.details
    own = details.get(f"{channel}_floor")
    named = own if own is not None else details.get("floor", details.get("shaker_floor"))
    place = f"tests.{recording.name}.channels.{channel}"
    if named is None:
        raise UserError(source, place, "does not say on which floor the shaker acts", "add floor: 1 (or another)")
    floor = int(named)
    if not 1 <= floor <= floors:
        raise UserError(source, f"{place}.floor", f"is {floor}", f"the frame has floors 1 to {floors}")
    return floor


def _inputs(recording: Recording, source: Path, floors: int) -> dict[Place, FloatArray]:
    """Return the measured excitations: forces first, then ground motion."""
    forces, ground = {}, {}
    for name, values in recording.channels.items():
        force, base = _FORCE_CHANNEL.match(name), _GROUND_CHANNEL.match(name)
        if force:
            direction = str(recording.details.get(f"{name}_direction") or "")
            forces[Place(_shaker_floor(recording, name, source, floors), direction)] = values
        elif base:
            ground[Place(0, base.group(1) or "")] = values
    return {**forces, **ground}


def _cut(recording: Recording) -> tuple[slice, str]:
    """Return the longest unbroken part of a recording, and a note where a gap in the clock made it shorter."""
    # a modal fit needs an unbroken record
    begin, end, gaps = longest_part(recording.time_s, recording.sampling_rate_hz, recording.segments)
    first, last = recording.time_s[begin], recording.time_s[end - 1]
    note = f"its clock has gaps; the longest part without one is used, from {first:.4g} to {last:.4g} s"
    return slice(begin, end), note if gaps else ""


def require_signal(recording: Recording, names: Iterable[str], part: slice, source: Path) -> None:
    """Refuse a channel that never changes.

    Parameters
    ----------
    recording, names
        The test, and the channels that are looked at.
    part
        Samples that are used.
    source
        campaign.yaml, for messages.

    Raises
    ------
    UserError
        Naming the channel.
    """
    for name in names:
        values = recording.channels[name][part]
        if np.ptp(values) == 0.0:
            place = f"tests.{recording.name}.channels.{name}"
            problem = f"never changes: all samples are {values[0]:g}"
            remedy = "leave the channel out of this test, or name the right column"
            if not _FLOOR_CHANNEL.match(name):
                remedy = "name the right column, or write kind: ambient where the excitation was not measured"
            raise UserError(source, place, problem, remedy)


def frame_test(recording: Recording, source: Path, floors: int = 0) -> FrameTest:
    """Return a recording of a frame as arrays.

    Parameters
    ----------
    recording
        Recording with channels floor_acceleration_i or floor_displacement_i, and ground_acceleration or input_force.
    source
        campaign.yaml, for messages.
    floors
        Number of floors; 0 takes the highest floor with a channel.

    Raises
    ------
    UserError
        If no floor has a channel, the floor of the shaker is missing or does not exist, or a forced test has no
        excitation.
    """
    sensors = _sensors(recording)
    place = f"tests.{recording.name}.channels"
    if not sensors:
        raise UserError(source, place, f"no {ACCELERATION}_1", "at least one floor needs a channel")
    n = floors or max(sensor.floor for sensor in sensors)
    beyond = [name for sensor, name in sensors.items() if sensor.floor > n]
    if beyond:
        raise UserError(source, f"{place}.{beyond[0]}", "is above the top floor", f"the frame has floors 1 to {n}")
    mode = int(recording.details.get("mode") or 0)
    if mode > n and not any(sensor.direction for sensor in sensors):
        remedy = f"a frame of {n} floors has {n} modes; correct it, or leave it out"
        raise UserError(source, f"tests.{recording.name}.mode", f"is {mode}", remedy)
    part, note = _cut(recording)
    require_signal(recording, sensors.values(), part, source)
    inputs = [(where, values[part]) for where, values in _inputs(recording, source, n).items()]
    if inputs and recording.kind in {"sweep", "random"}:
        # of several shakers some may rest in a test
        moving = [(where, values) for where, values in inputs if np.ptp(values) > 0.0]
        if not moving:
            require_signal(recording, filter(is_input, recording.channels), part, source)
        inputs = moving
    if not inputs and recording.kind in {"sweep", "random"}:
        raise UserError(
            source,
            place,
            "no ground_acceleration",
            "add it, or input_force with its floor, or write kind: ambient where the excitation was not measured",
        )
    first, values = inputs[0] if inputs else (Place(0), None)
    seen, driven = (
        {item.direction[:1] for item in items} - {""} for items in (sensors, [place for place, _ in inputs])
    )
    if seen and driven and not seen & driven:
        where = f"its excitation acts along {', '.join(driven)} and its sensors along {', '.join(seen)}"
        note = "; ".join(filter(None, (note, f"{where}: correct the suffixes of the channels if that is not meant")))
    lasers = sorted(
        (int(match.group(2)), name)
        for name in recording.channels
        if (match := _FLOOR_CHANNEL.match(name)) and match.group(1) == DISPLACEMENT and not match.group(3)
    )
    return FrameTest(
        name=recording.name,
        kind=recording.kind,
        sampling_rate_hz=recording.sampling_rate_hz,
        excitation=None if recording.kind == "ambient" else values,
        responses=np.column_stack([recording.channels[name][part] for name in sensors.values()]),
        is_displacement=tuple(sensor.is_displacement for sensor in sensors),
        shaker_floor=first.floor,
        mode=mode,
        role=recording.role,
        displacements=tuple((floor, recording.channels[name][part]) for floor, name in lasers),
        places=tuple(Place(sensor.floor, sensor.direction) for sensor in sensors),
        further_inputs=() if recording.kind == "ambient" else tuple(inputs[1:]),
        direction=first.direction,
        added_masses=_added_masses(recording, source, n, {sensor.floor for sensor in sensors}),
        note=note,
        is_clipped=any(clipped_share(recording.channels[name][part]) > 0.0 for name in sensors.values()),
        is_part=part.start is not None and part.start > 0,
    )


def _added_masses(recording: Recording, source: Path, floors: int, measured: set[int]) -> tuple[tuple[int, float], ...]:
    added = {int(floor): float(mass) for floor, mass in (recording.details.get("added_masses_kg") or {}).items()}
    place = f"tests.{recording.name}.added_masses_kg"
    for floor in sorted(added):
        if floor > floors:
            raise UserError(source, place, f"names floor {floor}", f"the frame has floors 1 to {floors}")
        if floor not in measured:
            remedy = "add a sensor on this floor, because its motion determines the inertia force of the added mass"
            raise UserError(source, place, f"floor {floor} has no sensor in this test", remedy)
    return tuple(sorted(added.items()))


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


def frame_tests(campaign: Campaign) -> FrameTests:
    """Return the forced, ambient and decay tests of a frame campaign; free decays alone are sufficient for modes.

    Raises
    ------
    UserError
        If the rig is not a shear-frame, no test shows modes, or masses are too few or not positive.
    """
    source = campaign.file
    if campaign.rig != "shear-frame":
        raise UserError(source, "rig", f"is {campaign.rig!r}", "identify-frame needs a campaign of a shear-frame")
    divided = in_unbroken_parts(campaign, {"sweep", "random", "ambient"})
    campaign = divided.campaign
    used = [item for item in campaign.recordings if item.kind in {"sweep", "random", "ambient"}]
    used = used or [item for item in campaign.recordings if item.kind == "free-decay"]
    if not used:
        remedy = "modes need a test of kind sweep, random, ambient or free-decay"
        raise UserError(source, "tests", "no test of a kind that shows modes", remedy)
    masses = np.asarray(campaign.floor_masses_kg, dtype=np.float64)
    floors = masses.size or max(frame_test(item, source).floors for item in used)
    if masses.size:
        check_masses(masses, max(frame_test(item, source).floors for item in used), source)
    else:
        masses = np.full(floors, np.nan)

    def of_kind(*kinds: str) -> tuple[FrameTest, ...]:
        found = [frame_test(item, source, floors) for item in campaign.recordings if item.kind in kinds]
        return tuple(test for test in found if not test.added_masses)

    every = [frame_test(item, source, floors) for item in used]
    changed = tuple(test for test in every if test.added_masses)
    if len(changed) == len(every):
        place = f"tests.{changed[0].name}.added_masses_kg"
        raise UserError(
            source, place, "all tests have added masses", "record a test of the same kind without them as well"
        )
    directions = {sensor.direction for item in used for sensor in _sensors(item)}
    positions, inertias = floor_plan(campaign, directions, floors, source)
    return FrameTests(
        of_kind("sweep", "random"), of_kind("free-decay"), masses, source, of_kind("ambient"), changed, positions,
        inertias, divided.notes,
    )  # fmt: skip
