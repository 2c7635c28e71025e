"""NI TDMS files (LabVIEW, DIAdem, FlexLogger)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, constant_rate, optional, short_names
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    """Return the channels as `group/channel`; a channel's name alone will do where it is unique.

    The clock is that of the waveform properties (`wf_increment`), if the first channel has them.
    """
    nptdms = optional("nptdms", "npTDMS", "tdms", path)
    file = nptdms.TdmsFile.read_metadata(str(path))
    channels = {
        f"{group.name}/{channel.name}": channel
        for group in file.groups()
        for channel in group.channels()
        if len(channel)
    }
    if not channels:
        raise UserError(path, "", "holds no channel with samples", "export the measurement again")
    names = list(channels)
    step = float(channels[names[0]].properties.get("wf_increment", 0.0))
    same = all(float(item.properties.get("wf_increment", 0.0)) == step for item in channels.values())
    start = float(channels[names[0]].properties.get("wf_start_offset", 0.0))
    time = None
    if step > 0.0 and same:
        time = np.asarray(start + step * np.arange(len(channels[names[0]])), dtype=np.float64)

    def fetch(name: str) -> Any:
        group, _, channel = name.partition("/")
        with nptdms.TdmsFile.open(str(path)) as opened:
            values = np.asarray(opened[group][channel][:])
        if values.dtype.kind == "M":
            return (values - values[0]) / np.timedelta64(1, "s")
        return values

    return DataFile(
        path=path,
        names=tuple(names),
        fetch=fetch,
        table=True,
        time_s=time,
        sampling_rate_hz=None if time is None else constant_rate(time),
        aliases=short_names(names, "/"),
    )


READER = Reader((".tdms",), _read)
