"""Dead channels, spikes, units and repeated records of a frame campaign."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.plausibility.channels import find_spikes, is_dead
from mrpipe.campaigns.plausibility.duplicates import find_overlaps
from mrpipe.campaigns.plausibility.finding import Finding
from mrpipe.campaigns.plausibility.library import Check
from mrpipe.campaigns.schema import floor_of
from mrpipe.words import in_percent

DECADES = 200.0
"""Ratio of the RMS of one floor's channel to those of all other floors from which its unit is suspected."""

SPIKE_SHARE = 1.0
"""A spike deviates by more than this share of the range of 99 % of the samples; impacts are sharp in accelerations."""


def _judge(campaign: Campaign) -> Iterator[Finding]:
    for test in campaign.recordings:
        yield from _channels(test)
        for kind in ("acceleration", "displacement", "velocity"):
            yield from _floors(test, kind)
    if not campaign.floor_masses_kg and any(test.kind != "closed-loop" for test in campaign.recordings):
        yield Finding(
            name="masses-missing",
            severity="warning",
            sentence="the masses of the floors are not given, so mass and stiffness matrices cannot be identified",
            remedy="write frame: {floor_masses_kg: [...]} with the masses in kg, lowest floor first",
        )
    records = [(test.name, _moving(test)) for test in campaign.recordings]
    roles = {test.name: test.role for test in campaign.recordings}
    for overlap in find_overlaps([item for item in records if item[1]]):
        leak = {roles[overlap.first], roles[overlap.second]} == {"training", "validation"}
        yield Finding(
            name="same-record",
            severity="error" if leak else "warning",
            test=overlap.second,
            sentence=f"holds {in_percent(overlap.share, digits=3)} of the samples of test {overlap.first}",
            remedy="name another file or other segments_s, or remove one of the two tests",
            numbers={"share": overlap.share},
        )


def _moving(test: Recording) -> dict[str, np.ndarray]:
    names = [name for name in test.channels if floor_of(name) is not None and not is_dead(test.used(name))]
    return {name: test.used(name) for name in names}


def _channels(test: Recording) -> Iterator[Finding]:
    for name in test.channels:
        if "drive" in name or "desired" in name:
            continue
        values = test.used(name)
        if is_dead(values):
            # the signals of a fixed table or of an absent damper may be recorded as zero
            if floor_of(name) is not None:
                yield Finding(
                    name="dead-channel",
                    severity="error",
                    test=test.name,
                    channel=name,
                    sentence=f"has the same value in all {values.size} samples ({values[0]:.4g} in SI)",
                    remedy="check sensor, cable and column, or leave the channel out",
                    numbers={"value_si": float(values[0]), "samples": float(values.size)},
                )
            continue
        spikes = find_spikes(values, SPIKE_SHARE)
        if spikes.size:
            largest = float(values[spikes][np.argmax(np.abs(values[spikes]))])
            yield Finding(
                name="spikes",
                severity="warning",
                test=test.name,
                channel=name,
                sentence=f"has {spikes.size} samples far from their neighbours, the largest {largest:.4g} (SI)",
                remedy="correct these samples in the file, or cut them off with segments_s",
                numbers={"samples": float(spikes.size), "largest_si": largest},
            )


def _floors(test: Recording, kind: str) -> Iterator[Finding]:
    """Yield floors whose channel is decades above or below those of all other floors."""
    names = [name for name in test.channels if floor_of(name) is not None and kind in name]
    sizes = {name: float(np.std(test.used(name))) for name in names}
    sizes = {name: size for name, size in sizes.items() if not is_dead(test.used(name))}
    if len(sizes) < 3:
        return
    for name, size in sizes.items():
        others = [other for key, other in sizes.items() if key != name]
        ratio = size / max(others) if size > max(others) else size / min(others) if size < min(others) else 1.0
        if ratio > DECADES or ratio < 1.0 / DECADES:
            yield Finding(
                name="unit-decades",
                severity="warning",
                test=test.name,
                channel=name,
                sentence=f"its RMS is {ratio:.3g} times that of any other floor",
                remedy="correct its unit or scale, or check the sensor",
                numbers={"ratio": ratio},
            )


CHECK = Check("frame-channels", _judge, rigs=("shear-frame",))
