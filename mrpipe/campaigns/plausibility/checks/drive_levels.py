"""Whether the drive of a bench campaign has more than one level, and none below zero."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.checks import drive_varies, levels_of, noise_of_levels
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.plausibility.finding import Finding
from mrpipe.campaigns.plausibility.library import Check

NEGATIVE = 0.05
"""Drive below zero, over the largest magnitude, from which it is reported; smaller ones are the offset of a sensor."""


def _drives(tests: Iterable[Recording]) -> list[FloatArray]:
    return [test.used("drive") for test in tests if "drive" in test.channels]


def _judge(campaign: Campaign) -> Iterator[Finding]:
    training = _drives(campaign.with_role("training"))
    if training:
        yield from _one_level(campaign, training)
    every = _drives(campaign.recordings)
    if every and not _is_zero(every):
        yield from _below_zero(campaign)


def _is_zero(drives: Sequence[FloatArray]) -> bool:
    """Whether a drive is the noise of its sensor about zero."""
    return float(np.abs(levels_of(drives)).max()) <= noise_of_levels(drives)


def _below_zero(campaign: Campaign) -> Iterator[Finding]:
    """Yield a finding where the drive is negative: an error in all tests, a warning in some."""
    levels = {test.name: levels_of(_drives([test])) for test in campaign.recordings if "drive" in test.channels}
    largest = max((float(np.abs(item).max()) for item in levels.values()), default=0.0)
    below = {name: float(item.min()) for name, item in levels.items() if item.min() < -NEGATIVE * largest}
    if not below:
        return
    above = any(item.max() > NEGATIVE * largest for item in levels.values())
    unit, lowest = campaign.drive_unit, min(below.values())
    yield Finding(
        name="drive-negative",
        severity="warning" if above else "error",
        test=next(iter(below)) if len(below) == 1 else "",
        channel="drive",
        sentence=f"the drive is negative, down to {lowest:.4g} {unit}, in {len(below)} of {len(levels)} tests, but the "
        "damper models hold for drives from 0 upwards",
        remedy="leave these tests out, or record the magnitude of the drive" if above else "give the drive `scale: -1`",
        numbers={f"lowest_{unit.lower()}": lowest, "tests": float(len(below))},
    )


def _one_level(campaign: Campaign, drives: Sequence[FloatArray]) -> Iterator[Finding]:
    unit = campaign.drive_unit
    if _is_zero(drives):
        yield Finding(
            name="drive-always-zero",
            severity="warning",
            channel="drive",
            sentence="the drive is 0 in all training tests, so only the damper without current is identified and no "
            "inverse model is possible",
            remedy="check the column of the drive, or add training tests at other drives",
            numbers={f"level_{unit.lower()}": 0.0},
        )
    elif not drive_varies(drives):
        level = float(levels_of(drives).mean())
        yield Finding(
            name="one-drive-level",
            severity="warning",
            channel="drive",
            sentence=f"the drive is {level:.4g} {unit} in all training tests, so no inverse model is possible, "
            "and the damper model is valid for this drive only",
            remedy="add training tests at another drive",
            numbers={f"level_{unit.lower()}": level},
        )


CHECK = Check("drive-levels", _judge, rigs=("damper-bench",))
