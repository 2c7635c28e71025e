"""Whether the drive of a bench campaign has more than one level."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrpipe.campaigns.model import Campaign
from mrpipe.campaigns.plausibility.finding import Finding
from mrpipe.campaigns.plausibility.library import Check


def _judge(campaign: Campaign) -> Iterator[Finding]:
    training = [test.used("drive") for test in campaign.with_role("training") if "drive" in test.channels]
    if not training:
        return
    # the mean of each twentieth of a record separates a level from the noise on it
    levels = np.concatenate([[block.mean() for block in np.array_split(drive, 20) if block.size] for drive in training])
    largest = float(np.abs(levels).max())
    unit = campaign.drive_unit
    if largest == 0.0:
        yield Finding(
            name="drive-always-zero",
            severity="warning",
            channel="drive",
            sentence="the drive is 0 in all training tests, so only the damper without current is identified and no "
            "inverse model is possible",
            remedy="check the column of the drive, or add training tests at other drives",
            numbers={f"level_{unit.lower()}": 0.0},
        )
    elif float(np.ptp(levels)) <= 0.01 * largest:
        level = float(levels.mean())
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
