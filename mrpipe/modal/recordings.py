"""Frame tests from the recordings of a campaign: channels, floors and directions, and the checks on them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.checks import clipped_share
from mrpipe.campaigns.clock import longest_part
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.parts import in_unbroken_parts
from mrpipe.errors import UserError
from mrpipe.modal.declared import check_masses, floor_plan
from mrpipe.modal.records import FrameTest, FrameTests, Place, Sensor

ACCELERATION = "floor_acceleration"
DISPLACEMENT = "floor_displacement"
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
    n = floors or max((sensor.floor for sensor in sensors), default=0)
    _check_floors(recording, sensors, source, n)
    part, note = _cut(recording)
    require_signal(recording, sensors.values(), part, source)
    inputs = _moving_inputs(recording, part, source, n)
    first, values = inputs[0] if inputs else (Place(0), None)
    note = "; ".join(filter(None, (note, _across(sensors, [where for where, _ in inputs]))))
    return FrameTest(
        name=recording.name,
        kind=recording.kind,
        sampling_rate_hz=recording.sampling_rate_hz,
        excitation=None if recording.kind == "ambient" else values,
        responses=np.column_stack([recording.channels[name][part] for name in sensors.values()]),
        is_displacement=tuple(sensor.is_displacement for sensor in sensors),
        shaker_floor=first.floor,
        mode=int(recording.details.get("mode") or 0),
        role=recording.role,
        displacements=_lasers(recording, part),
        places=tuple(Place(sensor.floor, sensor.direction) for sensor in sensors),
        further_inputs=() if recording.kind == "ambient" else tuple(inputs[1:]),
        direction=first.direction,
        added_masses=_added_masses(recording, source, n, {sensor.floor for sensor in sensors}),
        note=note,
        is_clipped=any(clipped_share(recording.channels[name][part]) > 0.0 for name in sensors.values()),
        is_part=part.start is not None and part.start > 0,
    )


def _check_floors(recording: Recording, sensors: Mapping[Sensor, str], source: Path, floors: int) -> None:
    """Refuse a recording without sensors, with a sensor above the top floor, or with a mode that does not exist."""
    place = f"tests.{recording.name}.channels"
    if not sensors:
        raise UserError(source, place, f"no {ACCELERATION}_1", "at least one floor needs a channel")
    beyond = [name for sensor, name in sensors.items() if sensor.floor > floors]
    if beyond:
        raise UserError(source, f"{place}.{beyond[0]}", "is above the top floor", f"the frame has floors 1 to {floors}")
    mode = int(recording.details.get("mode") or 0)
    if mode > floors and not any(sensor.direction for sensor in sensors):
        remedy = f"a frame of {floors} floors has {floors} modes; correct it, or leave it out"
        raise UserError(source, f"tests.{recording.name}.mode", f"is {mode}", remedy)


def _moving_inputs(recording: Recording, part: slice, source: Path, floors: int) -> list[tuple[Place, FloatArray]]:
    """Return the places of the excitation and its history in a `part` of the record; of several shakers some may rest.

    Raises
    ------
    UserError
        If a forced test has no excitation, or all of it is constant.
    """
    inputs = [(where, values[part]) for where, values in _inputs(recording, source, floors).items()]
    if recording.kind not in {"sweep", "random"}:
        return inputs
    if not inputs:
        remedy = "add it, or input_force with its floor, or write kind: ambient where the excitation was not measured"
        raise UserError(source, f"tests.{recording.name}.channels", "no ground_acceleration", remedy)
    moving = [(where, values) for where, values in inputs if np.ptp(values) > 0.0]
    if not moving:
        require_signal(recording, filter(is_input, recording.channels), part, source)
    return moving


def _across(sensors: Iterable[Sensor], inputs: Iterable[Place]) -> str:
    """Return a note if no sensor measures in a direction of the excitation; empty if one does."""
    seen, driven = ({item.direction[:1] for item in items} - {""} for items in (sensors, inputs))
    if not seen or not driven or seen & driven:
        return ""
    where = f"its excitation acts along {', '.join(driven)} and its sensors along {', '.join(seen)}"
    return f"{where}: correct the suffixes of the channels if that is not meant"


def _lasers(recording: Recording, part: slice) -> tuple[tuple[int, FloatArray], ...]:
    """Return floors and displacements of the sensors of displacement without a direction, lowest floor first."""
    found = sorted(
        (int(match.group(2)), name)
        for name in recording.channels
        if (match := _FLOOR_CHANNEL.match(name)) and match.group(1) == DISPLACEMENT and not match.group(3)
    )
    return tuple((floor, recording.channels[name][part]) for floor, name in found)


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
