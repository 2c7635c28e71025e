"""What campaign.yaml may hold, as typed models; unknown keys are refused."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

BENCH_QUANTITIES = {
    "time": "time",
    "displacement": "displacement",
    "velocity": "velocity",
    "acceleration": "acceleration",
    "drive": "drive",
    "force": "force",
}
"""Channel of a bench test -> physical quantity (`drive` is a current or a voltage)."""

FRAME_QUANTITIES = {
    "time": "time",
    "ground_acceleration": "acceleration",
    "ground_displacement": "displacement",
    "input_force": "force",
    "damper_force": "force",
    "damper_displacement": "displacement",
    "damper_velocity": "velocity",
    "drive": "drive",
    "desired_drive": "drive",
    "desired_force": "force",
}
"""Channel of a frame test -> physical quantity, in addition to the numbered floor channels."""

_FLOOR = re.compile(r"^floor_(acceleration|displacement|velocity)_([1-9][0-9]*)(?:_[a-z][a-z0-9]*)?$")
_FURTHER_INPUT = re.compile(r"^(?:(ground_acceleration)|(input_force))_[a-z0-9]+$")


def quantity_of(channel: str, rig: str) -> str | None:
    """Return the physical quantity of a channel, None where the rig has no such channel."""
    if rig == "shear-frame":
        match, further = _FLOOR.match(channel), _FURTHER_INPUT.match(channel)
        if further:
            return "acceleration" if further.group(1) else "force"
        return match.group(1) if match else FRAME_QUANTITIES.get(channel)
    return BENCH_QUANTITIES.get(channel)


def known_channels(rig: str) -> list[str]:
    """Return the names of channels that a rig may have."""
    if rig == "shear-frame":
        return [*FRAME_QUANTITIES, "floor_acceleration_1", "floor_displacement_1", "floor_velocity_1"]
    return list(BENCH_QUANTITIES)


def floor_of(channel: str) -> int | None:
    """Return the floor number in the name of a floor channel, else None."""
    match = _FLOOR.match(channel)
    return int(match.group(2)) if match else None


class Entry(BaseModel):
    """Base of all entries: unknown keys refused, frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ChannelEntry(Entry):
    """Where a quantity is in the files: value = scale * column + offset, in `unit`; or a constant `value`.

    `set_point` says that a recorded drive is the command and not a measurement. `floor` and `direction` say where an
    input force acts. `mass_kg` belongs to an input force that is recorded as the absolute acceleration of a moving
    mass: the force on the floor is its reaction.
    """

    column: str | int | None = None
    value: float | None = None
    unit: str | None = None
    scale: float = 1.0
    offset: float = 0.0
    floor: int | None = Field(default=None, ge=1)
    direction: str | None = None
    mass_kg: float | None = Field(default=None, gt=0.0)
    set_point: bool = False

    @field_validator("unit", mode="before")
    @classmethod
    def _unit_is_text(cls, value: Any) -> Any:
        return str(value) if isinstance(value, int) and not isinstance(value, bool) else value

    @field_validator("column", mode="before")
    @classmethod
    def _column_is_no_truth_value(cls, value: Any) -> Any:
        if isinstance(value, bool):
            raise ValueError("write the name of a column in quotes, or its number")
        return value

    @field_validator("scale")
    @classmethod
    def _scale_keeps_the_signal(cls, value: float) -> float:
        if value == 0.0 or not math.isfinite(value):
            raise ValueError("a finite number other than 0 expected, because 0 removes the signal")
        return value

    @model_validator(mode="after")
    def _one_source(self) -> ChannelEntry:
        if self.column is not None and self.value is not None:
            raise ValueError("either column or value expected, not both")
        return self


class TextEntry(Entry):
    """Layout of delimited text, if it cannot be found from the file."""

    skip_lines: int = Field(default=0, ge=0)
    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    comment: str | None = None


class FrameEntry(Entry):
    """Known properties of a frame; `sensor_positions_m` holds x and y of the sensors by the suffix of the channels."""

    floor_masses_kg: tuple[float | None, ...] = ()
    floor_inertias_kg_m2: tuple[float, ...] = ()
    sensor_positions_m: dict[str, tuple[float, float]] = Field(default_factory=dict)
    about: dict[str, Any] = Field(default_factory=dict)

    @field_validator("floor_masses_kg")
    @classmethod
    def _positive(cls, value: tuple[float | None, ...]) -> tuple[float | None, ...]:
        if any(mass is not None and not mass > 0.0 for mass in value):
            raise ValueError("masses above zero expected (null where a mass is unknown)")
        return value

    @field_validator("floor_inertias_kg_m2")
    @classmethod
    def _positive_inertias(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if any(not inertia > 0.0 for inertia in value):
            raise ValueError("moments of inertia above zero expected")
        return value

    @field_validator("sensor_positions_m")
    @classmethod
    def _axes(cls, value: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        wrong = [name for name in value if not name.startswith(("x", "y"))]
        if wrong:
            raise ValueError(f"{wrong[0]}: suffix of a channel expected that begins with its axis, x or y")
        return value


class DirectoryEntry(Entry):
    """Folder of the public measurements (`public_data: utfsm`) in which the files lie."""

    public_data: str


class TestEntry(Entry):
    """One test; `details` of the recording are the keys below the line of `about`."""

    __test__ = False

    name: str
    file: str = Field(min_length=1)
    role: Literal["training", "validation", "repeat"] | None = None
    kind: Literal["sweep", "free-decay", "closed-loop", "random", "ambient"] | None = None
    channels: dict[str, Any] = Field(default_factory=dict)
    segments_s: tuple[tuple[float, float], ...] | None = None
    part: int | None = Field(default=None, ge=1)
    sampling_rate_hz: float | None = Field(default=None, gt=0)
    about: dict[str, Any] = Field(default_factory=dict)

    mode: int | None = Field(default=None, ge=1)
    added_masses_kg: dict[int, float] | None = None
    law: str | None = None
    gains: dict[str, float] | None = None
    repeat_of: str | None = None
    excitation: str | None = None
    frequency_hz: float | None = None
    amplitude_m: float | None = None
    notes: str | None = None

    @field_validator("name", mode="before")
    @classmethod
    def _name_is_text(cls, value: Any) -> Any:
        return str(value) if isinstance(value, (int, float)) else value

    @field_validator("name")
    @classmethod
    def _usable_name(cls, value: str) -> str:
        if not value.strip(". \t\n") or "/" in value:
            raise ValueError("a name without '/' expected, with at least one letter or digit")
        if len(value) > 120:
            raise ValueError("a name of at most 120 characters expected")
        return value

    @field_validator("file")
    @classmethod
    def _usable_file(cls, value: str) -> str:
        if not value.strip() or "\0" in value or any(len(part.encode()) > 255 for part in value.split("/")):
            raise ValueError("a file name expected, at most 255 bytes long")
        if len(value) > 4000:
            raise ValueError("a path of at most 4000 characters expected")
        return value

    @field_validator("added_masses_kg")
    @classmethod
    def _masses_on_floors(cls, value: dict[int, float] | None) -> dict[int, float] | None:
        if value is not None and (not value or any(floor < 1 or not mass > 0.0 for floor, mass in value.items())):
            raise ValueError("floor: mass in kg expected, such as {4: 250}, floors from 1 and masses above zero")
        return value

    @field_validator("segments_s", mode="before")
    @classmethod
    def _segments_are_pairs(cls, value: Any) -> Any:
        if value is None:
            return None
        pairs = value if isinstance(value, list) else []
        if not pairs or not all(isinstance(item, list | tuple) and len(item) == 2 for item in pairs):
            raise ValueError("a list of pairs expected, such as [[2, 5]] or [[2, 5], [8, 12]]")
        return value

    @field_validator("segments_s")
    @classmethod
    def _ordered(cls, value: tuple[tuple[float, float], ...] | None) -> tuple[tuple[float, float], ...] | None:
        if value is None:
            return None
        if any(not end > begin for begin, end in value):
            raise ValueError("pairs [begin, end] with begin before end expected")
        ordered = sorted(value)
        for (_, end), (begin, _) in pairwise(ordered):
            if begin < end:
                raise ValueError(f"segments overlap: one ends at {end:g} s, another begins at {begin:g} s")
        return value

    def details(self) -> dict[str, Any]:
        """Return what describes the test and steers nothing of its reading."""
        named = (
            "mode",
            "added_masses_kg",
            "law",
            "gains",
            "repeat_of",
            "excitation",
            "frequency_hz",
            "amplitude_m",
            "notes",
        )
        given = {key: getattr(self, key) for key in named if getattr(self, key) is not None}
        return {**self.about, **given}


class CampaignEntry(Entry):
    """The whole of campaign.yaml; tests are validated one by one so that an error names its line."""

    campaign: str = Field(min_length=1)
    rig: Literal["damper-bench", "shear-frame"]
    channels: dict[str, Any]
    tests: list[Any]
    sampling_rate_hz: float | None = Field(default=None, gt=0)
    directory: str | DirectoryEntry | None = None
    text: TextEntry = TextEntry()
    frame: FrameEntry = FrameEntry()
    declared_effects: tuple[str, ...] = ()
    source: str | None = None
    licence: str | None = None
    notes: str | None = None
    about: dict[str, Any] = Field(default_factory=dict)

    @field_validator("campaign", mode="before")
    @classmethod
    def _name_is_text(cls, value: Any) -> Any:
        return str(value) if value is not None and not isinstance(value, (dict, list)) else value
