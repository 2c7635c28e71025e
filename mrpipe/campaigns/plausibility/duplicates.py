"""Sequences of samples that occur in two tests: the same file twice, copies in other formats, overlapping segments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrpipe.artifacts import FloatArray

WINDOW = 32
"""Number of successive samples that are compared as one."""

RESOLUTION = 1e-4
"""Step to which samples are rounded, over the channel's standard deviation; copies may differ in printed digits."""

SMALLEST_SHARE = 0.02
"""Smallest share of a test's windows that must occur in another test."""

_KEEP_ONE_IN = 4


@dataclass(frozen=True)
class Overlap:
    """Two tests that share samples; `share` is that of the shorter test."""

    first: str
    second: str
    share: float


def find_overlaps(tests: Sequence[tuple[str, Mapping[str, FloatArray]]]) -> list[Overlap]:
    """Return pairs of tests that contain the same sequences of samples.

    Windows of :data:`WINDOW` samples of all common channels are reduced to one number each and compared, at any
    position in the two tests. Windows in which the rig rests are left out, because all rests look the same.

    Parameters
    ----------
    tests
        Name and channels (name -> shape (n,)) of each test.
    """
    if len(tests) < 2:
        return []
    common = sorted(set.intersection(*(set(channels) for _, channels in tests)))
    if not common:
        return []
    steps = {name: _step([channels[name] for _, channels in tests]) for name in common}
    common = [name for name in common if steps[name] > 0.0]
    if not common:
        return []
    hashes = [_windows({name: channels[name] for name in common}, steps) for _, channels in tests]
    owners = np.concatenate([np.full(item.size, index) for index, item in enumerate(hashes)])
    values = np.concatenate(hashes)
    order = np.argsort(values, kind="stable")
    values, owners = values[order], owners[order]
    counts: dict[tuple[int, int], int] = {}
    edges = np.flatnonzero(np.diff(values)) + 1
    starts = np.concatenate(([0], edges))
    ends = np.concatenate((edges, [values.size]))
    for start, end in zip(starts[ends - starts > 1], ends[ends - starts > 1], strict=True):
        present = sorted({int(owner) for owner in owners[start:end]})
        for position, first in enumerate(present):
            for second in present[position + 1 :]:
                counts[first, second] = counts.get((first, second), 0) + 1
    found = []
    for (first, second), count in sorted(counts.items()):
        share = count / max(min(hashes[first].size, hashes[second].size), 1)
        if share >= SMALLEST_SHARE and count >= 3:
            found.append(Overlap(tests[first][0], tests[second][0], min(1.0, float(share))))
    return found


def _step(columns: Sequence[FloatArray]) -> float:
    """Return a rounding step that is a power of ten, the same for all tests."""
    spread = float(np.median([float(np.std(values)) for values in columns]))
    return float(10.0 ** np.floor(np.log10(RESOLUTION * spread))) if spread > 0.0 else 0.0


def _windows(channels: Mapping[str, FloatArray], steps: Mapping[str, float]) -> NDArray[np.uint64]:
    """Return one number for each window in which the channels move; a fixed fraction of all numbers is kept."""
    size = next(iter(channels.values())).size
    if size < 2 * WINDOW:
        return np.zeros(0, dtype=np.uint64)
    sample = np.zeros(size, dtype=np.uint64)
    moving = np.zeros(size - WINDOW + 1, dtype=bool)
    with np.errstate(over="ignore", invalid="ignore"):
        for name, values in channels.items():
            # offset, so that round numbers do not lie on the edge between two roundings
            rounded = np.floor(np.clip(values / steps[name], -9e17, 9e17) + 0.37).astype(np.int64)
            sample = sample * np.uint64(1_000_003) + _mixed(rounded.astype(np.uint64))
            changes = np.concatenate(([0], np.cumsum(np.diff(rounded) != 0)))
            moving |= changes[WINDOW - 1 :] - changes[: size - WINDOW + 1] > WINDOW // 2
        total = np.zeros(size - WINDOW + 1, dtype=np.uint64)
        for place in range(WINDOW):
            total = total * np.uint64(0x9E3779B97F4A7C15) + sample[place : place + total.size]
        total = _mixed(total)
    kept = moving & (total % np.uint64(_KEEP_ONE_IN) == 0)
    return np.unique(total[kept])


def _mixed(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return well spread numbers (the finaliser of SplitMix64, Steele et al. 2014)."""
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))
