"""Reading a campaign: campaign.yaml and the files it names, as recordings in SI."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe import units
from mrpipe.artifacts import FloatArray, public_data_directory
from mrpipe.artifacts.yaml_source import Place, YamlSource, dotted, nearest, read_yaml, shown
from mrpipe.campaigns.checks import find_clipping, find_dropouts, force_sign, require_finite, require_roles
from mrpipe.campaigns.clock import build_clock
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.files import open_data_file
from mrpipe.campaigns.header import campaign_file
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.schema import (
    CampaignEntry,
    ChannelEntry,
    DirectoryEntry,
    TestEntry,
    floor_of,
    known_channels,
    quantity_of,
)
from mrpipe.campaigns.segments import find_segments, segments_beyond
from mrpipe.errors import UserError

_NEEDED_ON_BENCH = ("displacement", "force", "drive")
_DRIVE_REMEDY = "write A or V; for percent or a duty cycle give scale: the current in A of one such unit, and unit: A"
_ONLY_CLOSED_LOOP = (
    "damper_force",
    "damper_displacement",
    "damper_velocity",
    "drive",
    "desired_drive",
    "desired_force",
)


@dataclass
class _Reader:
    """State while the tests of one campaign are read."""

    source: YamlSource
    entry: CampaignEntry
    folder: Path
    files: dict[Path, DataFile] = field(default_factory=dict)
    drive_units: dict[str, str] = field(default_factory=dict)
    set_points: list[bool] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)

    def open(self, name: str) -> DataFile:
        path = self.folder / name
        if path not in self.files:
            self.files[path] = open_data_file(path, self.entry.text)
        return self.files[path]


def load_campaign(path: Path) -> Campaign:
    """Read a campaign.

    Parameters
    ----------
    path
        Directory with campaign.yaml, or a campaign file such as configs/campaigns/utfsm.yaml, whose `directory:` key
        names the folder of the files (`{public_data: NAME}`: the folder of the public measurements).

    Raises
    ------
    UserError
        For every fault of the campaign file or of the data that the reader can see; one line each.
    """
    file = campaign_file(path)
    source = read_yaml(file)
    entry = source.build(CampaignEntry, source.content, ())
    reader = _Reader(source, entry, _folder(source, entry))
    shared = _channels(source, entry.channels, entry.rig, ("channels",))
    if not entry.tests:
        raise source.error(("tests",), "is empty", "list at least one test")
    recordings = [_read_test(reader, shared, index) for index in range(len(entry.tests))]
    _require_unique_names(source, recordings)
    campaign = Campaign(
        name=entry.campaign,
        rig=entry.rig,
        directory=file.parent,
        recordings=tuple(recordings),
        drive_unit=next(iter(reader.drive_units.values()), ""),
        drive_is_set_point=bool(reader.set_points) and all(reader.set_points),
        declared_effects=entry.declared_effects,
        floor_masses_kg=tuple(np.nan if mass is None else mass for mass in entry.frame.floor_masses_kg),
        declared=_declared(source.content),
        file_name=file.name,
    )
    require_roles(campaign, str(file))
    _require_floors(source, campaign)
    for test in campaign.recordings:
        reader.findings += [f"test {test.name}: {line}" for line in (*find_clipping(test), *find_dropouts(test))]
    if campaign.rig == "damper-bench":
        campaign = _with_force_sign(campaign, reader.findings)
    return replace(campaign, findings=tuple(reader.findings))


def campaign_files(path: Path) -> tuple[Path, ...]:
    """Return the files of a campaign, campaign.yaml first, without reading the data.

    Raises
    ------
    UserError
        If the campaign file is faulty.
    """
    file = campaign_file(path)
    source = read_yaml(file)
    entry = source.build(CampaignEntry, source.content, ())
    folder = _folder(source, entry)
    names = []
    for index, item in enumerate(entry.tests):
        if not isinstance(item, dict) or "file" not in item:
            continue  # refused with the tests
        name = item["file"]
        if not isinstance(name, str) or not name.strip():
            raise source.error(("tests", index, "file"), f"is {shown(name)}", "the name of a data file expected")
        names.append(name)
    return (file, *(folder / name for name in dict.fromkeys(names)))


def _declared(content: dict[str, Any]) -> dict[str, Any]:
    own = {"campaign", "rig", "sampling_rate_hz", "channels", "tests", "directory", "text", "declared_effects"}
    return {key: value for key, value in content.items() if key not in own}


def _folder(source: YamlSource, entry: CampaignEntry) -> Path:
    if entry.directory is None:
        return source.path.parent
    if isinstance(entry.directory, DirectoryEntry):
        public = public_data_directory()
        folder = None if public is None else public / entry.directory.public_data
        if folder is None or not folder.is_dir():
            raise source.error(
                ("directory",),
                f"the public measurements {entry.directory.public_data!r} are not on this machine",
                "set MRPIPE_DATA to the folder that holds them (the documentation says where they are published)",
            )
        return folder
    folder = source.path.parent / entry.directory
    if not folder.is_dir():
        raise source.error(("directory",), f"{entry.directory!r} is not a directory", "name the folder of the files")
    # messages name files in it; `..` after a link leads elsewhere than its text says
    short = Path(os.path.normpath(folder))
    return short if short.is_dir() and short.samefile(folder) else folder


def _channels(source: YamlSource, content: dict[str, Any], rig: str, place: Place) -> dict[str, ChannelEntry]:
    channels = {}
    for name, entry in content.items():
        if quantity_of(name, rig) is None:
            raise source.error((*place, name), "unknown channel", nearest(name, known_channels(rig)))
        channels[name] = source.build(ChannelEntry, entry, (*place, name))
    return channels


def _merge(shared: ChannelEntry | None, own: ChannelEntry) -> ChannelEntry:
    """Complete a test's channel with the entries of the campaign that the test does not give."""
    if shared is None:
        return own
    inherited = {key: getattr(shared, key) for key in ("unit", "floor", "direction", "mass_kg")}
    if own.value is None:
        inherited |= {key: getattr(shared, key) for key in ("column", "value", "scale", "offset", "set_point")}
        if own.column is not None:
            inherited["value"] = None
    given = {key: getattr(own, key) for key in own.model_fields_set}
    return ChannelEntry(**{**inherited, **given})


def _test_entry(reader: _Reader, shared: dict[str, ChannelEntry], index: int) -> tuple[TestEntry, dict[str, Any]]:
    """Return a test's entry and its channels; a channel may also stand in the test itself (`drive: {value: ...}`)."""
    source, rig = reader.source, reader.entry.rig
    place: Place = ("tests", index)
    content = reader.entry.tests[index]
    if not isinstance(content, dict):
        raise source.error(place, f"is {shown(content)}", "write {name: ..., file: ..., role: ...}")
    direct = {key: value for key, value in content.items() if quantity_of(key, rig) and isinstance(value, dict)}
    rest = {key: value for key, value in content.items() if key not in direct}
    if "law" in rest:
        gains = {key: value for key, value in rest.items() if key not in TestEntry.model_fields and _number(value)}
        known = [key for key in gains if "did you mean" in nearest(key, TestEntry.model_fields)]
        if gains and not known:
            rest = {key: value for key, value in rest.items() if key not in gains}
            rest["gains"] = {**gains, **rest.get("gains", {})}
    entry = source.build(TestEntry, rest, place)
    own = _channels(source, entry.channels, rig, (*place, "channels")) | _channels(source, direct, rig, place)
    merged = dict(shared) | {name: _merge(shared.get(name), channel) for name, channel in own.items()}
    if rig == "damper-bench":
        missing = [name for name in _NEEDED_ON_BENCH if name not in merged]
        if missing:
            raise source.error(
                ("channels",),
                f"no channel {missing[0]}",
                f"write {missing[0]}: {{column: ..., unit: ...}}, or {{value: ..., unit: ...}} for a constant",
            )
        _require_own_columns(reader, merged, place)
        if entry.role is None:
            raise source.error((*place, "role"), "is missing", "write role: training, validation or repeat")
    elif entry.kind is None:
        guess = "closed-loop" if entry.law else "free-decay" if entry.mode else None
        if guess is None:
            remedy = "write kind: sweep, free-decay, closed-loop, random or ambient"
            raise source.error((*place, "kind"), "is missing", remedy)
        entry = entry.model_copy(update={"kind": guess})
    return entry, merged


def _require_own_columns(reader: _Reader, channels: dict[str, ChannelEntry], place: Place) -> None:
    """Raise where two channels of a bench test name the same column."""
    owners: dict[str | int, str] = {}
    for name, channel in channels.items():
        if channel.column is None:
            continue
        other = owners.setdefault(channel.column, name)
        if other != name:
            problem = f"names the column {channel.column!r}, which is also that of {other}"
            raise reader.source.error(_place_of(reader, name, place), problem, "give each channel its own column")


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _read_test(reader: _Reader, shared: dict[str, ChannelEntry], index: int) -> Recording:
    entry, channels = _test_entry(reader, shared, index)
    where = f"test {entry.name}"
    place: Place = ("tests", index)
    file = reader.open(entry.file)
    skipped = set() if entry.kind in (None, "closed-loop") else set(_ONLY_CLOSED_LOOP)
    columns = {
        name: _read_channel(reader, file, name, channel, place, where)
        for name, channel in channels.items()
        if channel.value is None and not (name in skipped and not _has(file, channel))
    }
    if not columns:
        raise reader.source.error(place, "no channel is read from the file", "give at least one channel a column")
    samples = _one_length(file, columns, where)
    rate = entry.sampling_rate_hz or reader.entry.sampling_rate_hz
    own = file.with_clock_of(channels[name].column or 0 for name in columns)
    clock = build_clock(own, columns.pop("time", None), rate, samples, where)
    reader.findings += [f"test {entry.name}: {line}" for line in clock.findings]
    for name, channel in channels.items():
        if channel.value is not None:
            columns[name] = np.full(samples, _constant(reader, name, channel, place))
    begin, end, segments = find_segments(reader.source, file, entry, clock, place)
    reader.findings += segments_beyond(entry, clock)
    values = {name: column[begin:end] for name, column in columns.items()}
    for name, column in values.items():
        for first, last in segments:
            require_finite(file, column[first:last], begin + first, name, where)
    if "drive" in channels:
        reader.set_points.append(channels["drive"].value is not None or channels["drive"].set_point)
    details = entry.details()
    for name, channel in channels.items():
        if name.startswith("input_force") and channel.floor:
            details[f"{name}_floor"] = channel.floor
            details |= {f"{name}_direction": channel.direction} if channel.direction else {}
    return Recording(
        name=entry.name,
        role=entry.role or "training",
        sampling_rate_hz=clock.sampling_rate_hz,
        time_s=clock.time_s[begin:end],
        channels=values,
        segments=segments,
        kind=entry.kind or "",
        details=details,
        file=file.path,
    )


def _has(file: DataFile, channel: ChannelEntry) -> bool:
    if channel.column is None:
        return False
    try:
        file.column(channel.column, "")
    except UserError:
        return False
    return True


def _place_of(reader: _Reader, name: str, place: Place) -> Place:
    """Return where a channel is written: in the test at `place`, else among the channels of the campaign."""
    own = ((*place, "channels", name), (*place, name))
    return next((item for item in own if item in reader.source.lines), ("channels", name))


def _unit(reader: _Reader, name: str, channel: ChannelEntry, place: Place) -> tuple[str, str | None]:
    """Return the unit of a channel and its quantity; the channel drive determines the drive unit of the campaign."""
    if channel.unit is None:
        usual = {"time": "s", "drive": "A"}.get(
            name, units.SI_UNITS.get(quantity_of(name, reader.entry.rig) or "", "N")
        )
        raise reader.source.error(
            (*_place_of(reader, name, place), "unit"), "is missing", f"write its unit, such as {usual}"
        )
    where = f"{reader.source.path}: {reader.source.where(_place_of(reader, name, place))}"
    quantity = quantity_of(name, reader.entry.rig)
    if quantity == "drive":
        kinds = ("current", "voltage")
        kind = next((item for item in kinds if units.same_dimension(channel.unit, item, where=where)), "")
        if not kind:
            raise UserError(where, f"unit {channel.unit!r}", "is not a unit of current or voltage", _DRIVE_REMEDY)
        known = reader.drive_units.setdefault("drive", units.SI_UNITS[kind])
        if known != units.SI_UNITS[kind]:
            problem = f"is in {units.SI_UNITS[kind]} in {dotted(place)} and in {known} in the tests before"
            remedy = (
                "use one of the two; a command in V becomes the current with unit: A, scale: (A per V) and offset: "
                "(A at 0 V)"
            )
            raise reader.source.error(_place_of(reader, name, place), problem, remedy)
        quantity = kind
    if channel.mass_kg is not None:
        quantity = "acceleration"
    elif name.startswith("input_force") and units.same_dimension(channel.unit, "acceleration", where=where):
        remedy = "give mass_kg of the moving mass where its acceleration was recorded, or a unit of force"
        raise UserError(where, f"unit {channel.unit!r}", "is not a unit of force", remedy)
    units.conversion(channel.unit, where=where, quantity=quantity)
    return channel.unit, quantity


def _read_channel(
    reader: _Reader, file: DataFile, name: str, channel: ChannelEntry, place: Place, where: str
) -> FloatArray:
    unit, quantity = _unit(reader, name, channel, place)
    if channel.column is None:
        raise reader.source.error(_place_of(reader, name, place), "has neither column nor value", "write column: ...")
    values = file.column(channel.column, f"{where}, {name}")
    file.require_one(channel.column, values, f"{where}, {name}")
    values = np.asarray(units.to_si(channel.scale * values + channel.offset, unit, quantity=quantity))
    return values if channel.mass_kg is None else -channel.mass_kg * values


def _constant(reader: _Reader, name: str, channel: ChannelEntry, place: Place) -> float:
    unit, quantity = _unit(reader, name, channel, place)
    value = float(units.to_si(np.float64(channel.value or 0.0), unit, quantity=quantity))
    if not np.isfinite(value):
        raise reader.source.error((*place, name, "value"), f"is {channel.value}", "a finite number expected")
    return value


def _one_length(file: DataFile, columns: dict[str, FloatArray], where: str) -> int:
    lengths = {name: values.size for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        sizes = ", ".join(f"{name} {size}" for name, size in lengths.items())
        raise UserError(file.path, where, f"channels differ in length ({sizes})", "choose columns of the same length")
    return next(iter(lengths.values()))


def _require_unique_names(source: YamlSource, recordings: list[Recording]) -> None:
    seen: set[str] = set()
    for index, test in enumerate(recordings):
        if test.name in seen:
            raise source.error(
                ("tests", index, "name"), f"{test.name!r} is used twice", "give each test a different name"
            )
        seen.add(test.name)


def _require_floors(source: YamlSource, campaign: Campaign) -> None:
    """Raise UserError if a floor has no sensor and the masses do not determine the number of floors."""
    if campaign.rig != "shear-frame":
        return
    masses = campaign.floor_masses_kg
    for test in campaign.recordings:
        floors = sorted({floor_of(name) or 0 for name in test.channels if name.startswith("floor_")})
        if floors and masses and len(masses) < floors[-1]:
            raise source.error(
                ("frame", "floor_masses_kg"),
                f"has {len(masses)} of {floors[-1]} masses",
                "give one for each measured floor",
            )


def _with_force_sign(campaign: Campaign, findings: list[str]) -> Campaign:
    """Reverse the force where compression was taken as positive. The sign of the work done on the rod shows this."""
    sign = force_sign(campaign.recordings)
    if sign >= -0.1:
        if sign < 0.1:
            findings.append("force and velocity are hardly related: the sign of the force cannot be determined")
        return campaign
    findings.append(f"force is positive in compression (correlation with velocity {sign:.2f}): its sign was reversed")
    turned = [
        replace(test, channels={**test.channels, "force": -test.channels["force"]}) for test in campaign.recordings
    ]
    return replace(campaign, recordings=tuple(turned))
