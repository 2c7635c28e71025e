"""Which samples of a file belong to a test: its part of the file, and its segments."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts.yaml_source import Place, YamlSource
from mrpipe.campaigns.clock import Clock
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.schema import TestEntry

Range = tuple[int, int]


def find_segments(
    source: YamlSource, file: DataFile, entry: TestEntry, clock: Clock, place: Place
) -> tuple[int, int, tuple[Range, ...]]:
    """Return the range of samples to keep, and the segments within it.

    Raises
    ------
    UserError
        If the file has no such part, or if a segment holds no sample.
    """
    time = clock.time_s
    parts: tuple[Range, ...] = file.parts or ((0, time.size),)
    if entry.part is not None:
        if entry.part > len(parts):
            problem = f"is {entry.part}, the file has {len(parts)}"
            raise source.error((*place, "part"), problem, f"write 1 to {len(parts)}")
        parts = (parts[entry.part - 1],)
    wanted = entry.segments_s or ((-np.inf, np.inf),)
    tolerance = 1e-3 / clock.sampling_rate_hz
    ranges = []
    for begin_s, end_s in wanted:
        first, last = np.searchsorted(time, [begin_s - tolerance, end_s - tolerance])
        hits = [(max(int(first), begin), min(int(last), end)) for begin, end in parts]
        hits = [(begin, end) for begin, end in hits if end > begin]
        if not hits:
            raise source.error(
                (*place, "segments_s"),
                f"[{begin_s:g}, {end_s:g}] holds no sample",
                f"the clock of {entry.file} runs from {time[0]:.6g} to {time[-1]:.6g} s",
            )
        ranges += hits
    ranges.sort()
    begin, end = ranges[0][0], ranges[-1][1]
    return begin, end, tuple((first - begin, last - begin) for first, last in ranges)


def segments_beyond(entry: TestEntry, clock: Clock) -> list[str]:
    """Return a line for each segment that is much longer than what the record holds of it.

    A segment that ends after the record is a usual way to say `to the end`, so only one that loses more than half of
    its length is reported.
    """
    first, last = float(clock.time_s[0]), float(clock.time_s[-1])
    return [
        f"test {entry.name}: segments_s is [{begin:g}, {end:g}] s, but the record holds only "
        f"{max(begin, first):.6g} to {min(end, last):.6g} s of it"
        for begin, end in entry.segments_s or ()
        if min(end, last) - max(begin, first) < 0.5 * (end - begin)
    ]
