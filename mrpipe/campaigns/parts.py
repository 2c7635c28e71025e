"""Parts of a recording without a gap: between lost samples, and the segments that campaign.yaml lists."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from mrpipe.campaigns.clock import unbroken_parts
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.words import counted

LEAST_SHARE = 0.5
"""Parts shorter than this share of the longest part of a recording are left out, because spectra need long windows."""


@dataclass(frozen=True)
class UnbrokenParts:
    """A campaign whose recordings have no gap, and a line for each recording that was divided or shortened."""

    campaign: Campaign
    notes: tuple[str, ...]


def in_unbroken_parts(campaign: Campaign, kinds: Collection[str]) -> UnbrokenParts:
    """Return the campaign with each recording of some kinds divided into its parts without a gap.

    A recording with one part keeps its name. Several parts are named with a number, such as `sweep-1` and `sweep-2`.

    Parameters
    ----------
    campaign
        The campaign.
    kinds
        Kinds of tests that may be divided.
    """
    recordings: list[Recording] = []
    notes: list[str] = []
    for item in campaign.recordings:
        if item.kind not in kinds:
            recordings.append(item)
            continue
        parts = unbroken_parts(item.time_s, item.sampling_rate_hz, item.segments)
        longest = max(end - begin for begin, end in parts)
        kept = [part for part in parts if part[1] - part[0] >= LEAST_SHARE * longest]
        recordings += [_part(item, part, number if len(kept) > 1 else 0) for number, part in enumerate(kept, 1)]
        note = _note(item, parts, kept)
        notes += [note] if note else []
    return UnbrokenParts(replace(campaign, recordings=tuple(recordings)), tuple(notes))


def _part(item: Recording, part: tuple[int, int], number: int) -> Recording:
    return replace(item, name=f"{item.name}-{number}" if number else item.name, segments=(part,))


def _note(item: Recording, parts: list[tuple[int, int]], kept: list[tuple[int, int]]) -> str:
    """Return what the user should know of the parts; empty if nothing was lost or divided by a gap."""
    short, gaps = len(parts) - len(kept), len(parts) > len(item.segments)
    if not short and not gaps:
        return ""
    used, whole = (sum(end - begin for begin, end in some) / item.sampling_rate_hz for some in (kept, parts))
    reason = "its clock has gaps" if gaps else "its segments differ in length"
    left_out = f", {counted(short, 'shorter one')} {'are' if short > 1 else 'is'} left out" if short else ""
    return (
        f"test {item.name}: {reason}; {counted(len(kept), 'part')} without a gap, {used:.4g} of {whole:.4g} s, "
        f"{'are' if len(kept) > 1 else 'is'} used{left_out}"
    )
