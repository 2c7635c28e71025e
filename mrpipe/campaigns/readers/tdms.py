"""NI TDMS files (LabVIEW, DIAdem, FlexLogger)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, optional, short_names
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError
from mrpipe.log_levels import errors_only

UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription")
"""Properties of a channel that hold its unit: of DIAdem and LabVIEW waveforms, and of DAQmx."""


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    """Return the channels as `group/channel`; a channel's name alone will do where it is unique.

    The clock of a channel is that of its waveform properties (`wf_increment`); groups may have different clocks.
    """
    nptdms = optional("nptdms", "npTDMS", "tdms", path)
    # a message of this package about a file that was cut off has several lines, and names no file
    with errors_only("nptdms"):
        file = nptdms.TdmsFile.read_metadata(str(path))
    channels = {
        f"{group.name}/{channel.name}": channel
        for group in file.groups()
        for channel in group.channels()
        if len(channel)
    }
    if not channels:
        raise UserError(path, "", "holds no channel with samples", "export the measurement again")
    lengths = [{len(channel) for channel in group.channels() if len(channel)} for group in file.groups()]
    if file.file_status.incomplete_final_segment and any(len(found) > 1 for found in lengths):
        problem = "is cut off: its last segment is shorter than the file says, and its channels differ in length"
        raise UserError(path, "", problem, "export the measurement again")
    names = list(channels)
    clocks = {name: clock for name, item in channels.items() if (clock := _clock(item))}

    def fetch(name: str) -> Any:
        group, _, channel = name.partition("/")
        with errors_only("nptdms"), nptdms.TdmsFile.open(str(path)) as opened:
            values = np.asarray(opened[group][channel][:])
        if values.dtype.kind == "M":
            return (values - values[0]) / np.timedelta64(1, "s")
        return values

    file = DataFile(
        path=path,
        names=tuple(names),
        fetch=fetch,
        table=True,
        clocks=clocks,
        aliases=short_names(names, "/"),
        units={name: unit for name, item in channels.items() if (unit := _unit(item.properties))},
    )
    return file.with_clock_of(names)


def _clock(channel: Any) -> tuple[float, float, int] | None:
    """Return start [s], interval [s] and number of samples of a channel, None where it is not a waveform."""
    step = float(channel.properties.get("wf_increment", 0.0))
    return (float(channel.properties.get("wf_start_offset", 0.0)), step, len(channel)) if step > 0.0 else None


def _unit(properties: Mapping[str, Any]) -> str:
    """Return the unit that the properties of a channel state, empty where they state none."""
    return next((text for key in UNIT_PROPERTIES if (text := str(properties.get(key, "")).strip())), "")


READER = Reader((".tdms",), _read)
