"""Recordings of a structure for the tracing: motion of all floors on one clock, from accelerometers alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.clock import longest_part
from mrpipe.campaigns.model import CAMPAIGN_FILE, Campaign, Recording
from mrpipe.campaigns.parts import in_unbroken_parts
from mrpipe.errors import UserError
from mrpipe.modal.recordings import is_input, require_signal

FASTEST_HZ = 250.0
"""Numerical technique: records are decimated to about this rate unless the caller gives another."""

UNEVEN = 0.02
"""Numerical technique: a clock whose steps differ by more than this share of their median is resampled."""


@dataclass(frozen=True)
class FrameRecord:
    """One test of a structure.

    Attributes
    ----------
    name, role, kind
        As in campaign.yaml.
    rate_hz
        Sampling rate.
    ground
        Ground acceleration, shape (m,) [m/s2]; zeros where a free decay recorded none.
    acceleration
        Absolute acceleration of every floor, shape (m, n) [m/s2].
    measured_displacement
        Floor (from 1) -> displacement relative to the ground, shape (m,) [m].
    loads
        Floor (from 1) -> known force on it, shape (m,) [N]: that of a shaker, or minus that of the damper.
    damper
        `force`, `drive`, `desired`, `displacement` of a closed-loop test, those that were recorded, shape (m,).
    from_displacement
        Floors whose acceleration was computed from the displacement.
    details
        Entries of the test in campaign.yaml.
    computed
        Floors (from 1) without a sensor, whose acceleration was computed.
    turning
        Angular acceleration of every floor about the vertical, shape (m, n) [rad/s2], or (m, 0) if it is not known.
    averages
        Channel -> averaged spectra, from which its noise is estimated again for each band and colour. They are computed
        when they are first needed; a changed record has none.
    """

    name: str
    role: str
    kind: str
    rate_hz: float
    ground: FloatArray
    acceleration: FloatArray
    measured_displacement: dict[int, FloatArray]
    loads: dict[int, FloatArray]
    damper: dict[str, FloatArray]
    from_displacement: tuple[int, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)
    computed: tuple[int, ...] = ()
    turning: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    averages: dict[tuple[str, int], Any] = field(default_factory=dict, init=False, compare=False, repr=False)

    @property
    def turns(self) -> int:
        """Number of floors whose rotation about the vertical is known: all or none."""
        return int(self.turning.shape[1])

    @property
    def dt(self) -> float:
        """Sampling interval [s]."""
        return 1.0 / self.rate_hz

    @property
    def floors(self) -> int:
        """Number of floors."""
        return int(self.acceleration.shape[1])

    @property
    def known_loads(self) -> dict[int, FloatArray]:
        """Return floor (from 1) -> measured force on it, including that of the damper, shape (m,) [N]."""
        return {**self.loads, **({1: self.damper["force"]} if "force" in self.damper else {})}

    @property
    def carries_device(self) -> bool:
        """Whether a shaker or a damper acts on a floor, so that the ground does not drive the structure alone."""
        return bool(self.loads or self.damper)

    @property
    def relative(self) -> FloatArray:
        """Acceleration relative to the ground, shape (m, n) [m/s2]."""
        return np.asarray(self.acceleration - self.ground[:, None])


@dataclass(frozen=True)
class FrameData:
    """The tests that record all floors, and the closed-loop tests, which may lack some.

    `source` is campaign.yaml, for messages. `notes` says which tests were divided at gaps of their clock.
    """

    masses_kg: FloatArray
    records: tuple[FrameRecord, ...]
    loops: tuple[Recording, ...]
    left_out: tuple[str, ...]
    source: Path = Path(CAMPAIGN_FILE)
    notes: tuple[str, ...] = ()

    def with_role(self, *roles: str) -> list[FrameRecord]:
        """Return the records of these roles."""
        return [item for item in self.records if item.role in roles]


TURN = "floor_turn_"
"""Beginning of the names of channels with the angular acceleration of a floor about the vertical [rad/s2]."""
COMPUTED = "computed_floors"
"""Key of the details of a test: floors (from 1) whose motion was computed from that of the others."""
_FLOORS = ("floor_acceleration_", "floor_displacement_")


def frame_data(campaign: Campaign, rate_hz: float = FASTEST_HZ) -> FrameData:
    """Return the recordings of a campaign of a shear frame that moves in one direction.

    Parameters
    ----------
    campaign
        The campaign, or one direction of it (:mod:`mrpipe.tracing.structure.directions`).
    rate_hz
        Rate to which faster records are decimated.

    Raises
    ------
    UserError
        If the masses are missing or do not fit the floors, no test records every floor, or there is no validation test.
    """
    source = campaign.file
    divided = in_unbroken_parts(campaign, {"sweep", "random"})
    campaign = divided.campaign
    floors = max((floor for item in campaign.recordings for floor in _floors_of(item)), default=0)
    loops = tuple(
        item
        for item in campaign.recordings
        if {"damper_force", "drive"} <= set(item.channels) or "drive" in item.channels
    )
    masses = np.asarray(campaign.floor_masses_kg, dtype=np.float64)
    whole, left_out = [], []
    for item in campaign.recordings:
        missing = without_sensor(item, floors)
        ground = "ground_acceleration" in item.channels or "input_force" in item.channels or item.kind == "free-decay"
        if missing or not ground:
            left_out.append(item.name)
            continue
        whole.append(item)
    if not whole and not loops:
        raise UserError(
            source,
            "channels",
            "no test records every floor and the ground",
            "give floor_acceleration_1, ... and ground_acceleration, or input_force with its floor",
        )
    if whole and masses.size != floors:
        raise UserError(
            source, "frame.floor_masses_kg", f"has {masses.size} entries, but the channels are for {floors} floors",
            "give the mass of every floor in kg",
        )  # fmt: skip
    unknown = np.flatnonzero(~np.isfinite(masses))
    if whole and unknown.size:
        problem = f"does not give the mass of floor {unknown[0] + 1}"
        raise UserError(source, "frame.floor_masses_kg", problem, "give the mass of every floor in kg")
    for item in whole:
        _require_signals(item, source)
    if not any(item.role == "validation" for item in (*whole, *loops)):
        raise UserError(source, "tests", "no validation test", "give one test the role validation")
    records = tuple(_record(item, rate_hz) for item in whole)
    return FrameData(masses, records, loops, tuple(left_out), source, divided.notes)


def _floors_of(recording: Recording) -> list[int]:
    found = {int(name.rpartition("_")[2]) for name in recording.channels if name.startswith(_FLOORS)}
    return sorted(found)


def without_sensor(recording: Recording, floors: int) -> list[int]:
    """Return the floors (from 1) for which a recording has neither acceleration nor displacement."""
    recorded = _floors_of(recording)
    return [floor for floor in range(1, floors + 1) if floor not in recorded]


def floor_of_force(recording: Recording) -> int:
    """Return the floor (from 1) on which the recorded force acts."""
    return int(recording.details.get("floor", recording.details.get("input_force_floor", 1)))


def part_of(recording: Recording) -> slice:
    """Return the longest part of a recording that is used and has no gap in its clock."""
    begin, end, _ = longest_part(recording.time_s, recording.sampling_rate_hz, recording.segments)
    return slice(begin, end)


def _require_signals(recording: Recording, source: Path) -> None:
    """Refuse a recording with a dead sensor, or a forced one whose excitation never changes."""
    part = part_of(recording)
    require_signal(recording, [name for name in recording.channels if name.startswith(_FLOORS)], part, source)
    inputs = [name for name in recording.channels if is_input(name)]
    forced = recording.kind in {"sweep", "random"} and "damper_force" not in recording.channels
    if forced and not any(np.ptp(recording.channels[name][part]) > 0.0 for name in inputs):
        require_signal(recording, inputs, part, source)


def thinning(rate_hz: float, wanted_hz: float) -> int:
    """Return the factor by which records are decimated to about the wanted rate."""
    return max(1, round(rate_hz / wanted_hz))


def on_even_clock(recording: Recording, values: FloatArray, part: slice, rate_hz: float) -> FloatArray:
    """Return a channel on the nominal clock, decimated to about `rate_hz` after a zero-phase low-pass."""
    time = recording.time_s[part]
    steps = np.diff(time)
    chosen = values[part]
    if float(np.ptp(steps)) > UNEVEN * float(np.median(steps)):
        even = np.arange(time[0], time[-1], 1.0 / recording.sampling_rate_hz)
        chosen = np.interp(even, time, chosen)
    factor = thinning(recording.sampling_rate_hz, rate_hz)
    if factor == 1:
        return np.asarray(chosen, dtype=np.float64)
    ratio = Fraction(1, factor)
    first = chosen[0]
    return np.asarray(
        first + signal.resample_poly(chosen - first, ratio.numerator, ratio.denominator), dtype=np.float64
    )


def _record(recording: Recording, rate_hz: float) -> FrameRecord:
    part = part_of(recording)
    channels = {
        name: on_even_clock(recording, values, part, rate_hz)
        for name, values in recording.channels.items()
        if name != "time"
    }
    rate = recording.sampling_rate_hz / thinning(recording.sampling_rate_hz, rate_hz)
    size = len(next(iter(channels.values())))
    ground = channels.get("ground_acceleration", np.zeros(size))
    floors = _floors_of(recording)
    displacement = {
        floor: channels[f"floor_displacement_{floor}"] for floor in floors if f"floor_displacement_{floor}" in channels
    }
    columns, derived = [], []
    for floor in floors:
        name = f"floor_acceleration_{floor}"
        if name in channels:
            columns.append(channels[name])
            continue
        derived.append(floor)
        twice = np.gradient(np.gradient(displacement[floor], 1.0 / rate), 1.0 / rate)
        columns.append(twice + ground)
    loads: dict[int, FloatArray] = {}
    if "input_force" in channels:
        loads[floor_of_force(recording)] = channels["input_force"]
    damper = {
        key: channels[name]
        for key, name in (
            ("force", "damper_force"), ("drive", "drive"), ("desired", "desired_force"),
            ("displacement", "damper_displacement"),
        )
        if name in channels
    }  # fmt: skip
    turning = [channels[f"{TURN}{floor}"] for floor in floors if f"{TURN}{floor}" in channels]
    return FrameRecord(
        recording.name, recording.role, recording.kind, rate, ground, np.column_stack(columns), displacement, loads,
        damper, tuple(derived), dict(recording.details), tuple(recording.details.get(COMPUTED, ())),
        np.stack(turning, axis=1) if turning else np.zeros((size, 0)),
    )  # fmt: skip
