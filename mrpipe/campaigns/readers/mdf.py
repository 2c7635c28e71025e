"""ASAM MDF files, version 3 and 4 (.mdf, .mf4)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.readers.reader import Reader, constant_rate, optional
from mrpipe.campaigns.schema import TextEntry
from mrpipe.errors import UserError


def _read(path: Path, _layout: TextEntry | None = None) -> DataFile:
    """Return the channels by name; a name that occurs in several groups is `name#group`.

    The clock is that of the group with the most samples. Channels of other groups are interpolated linearly onto it.
    """
    asammdf = optional("asammdf", "asammdf", "mdf", path)
    places: dict[str, tuple[int, int]] = {}
    clock = np.zeros(0)
    units: dict[str, str] = {}
    with asammdf.MDF(str(path)) as file:
        masters = dict(file.masters_db)
        for name, entries in file.channels_db.items():
            for group, index in entries:
                if masters.get(group) != index:
                    label = name if len(entries) == 1 else f"{name}#{group}"
                    places[label] = (group, index)
                    if unit := str(file.get_channel_unit(group=group, index=index) or "").strip():
                        units[label] = unit
        for group in {group for group, _ in places.values()}:
            times = np.asarray(file.get_master(group), dtype=np.float64)
            clock = times if times.size > clock.size else clock
    if not places or clock.size < 2:
        raise UserError(path, "", "holds no channel with samples", "export the measurement again")

    def fetch(name: str) -> Any:
        group, index = places[name]
        with asammdf.MDF(str(path)) as opened:
            signal = opened.get(group=group, index=index)
        samples, times = np.asarray(signal.samples), np.asarray(signal.timestamps, dtype=np.float64)
        if samples.dtype.kind not in "fiub" or np.array_equal(times, clock):
            return samples
        return np.interp(clock, times, samples)

    return DataFile(
        path=path,
        names=tuple(places),
        fetch=fetch,
        table=True,
        time_s=clock,
        sampling_rate_hz=constant_rate(clock),
        units=units,
    )


READER = Reader((".mf4", ".mdf"), _read)
