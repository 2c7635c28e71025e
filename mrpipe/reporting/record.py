"""Section of the report: a campaign that the virtual laboratory recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from mrpipe.reporting.sink import Sink


@dataclass(frozen=True)
class RecordedCampaign:
    """What was recorded; nothing of the rig's hidden effects.

    Attributes
    ----------
    campaign
        Folder of the campaign in the run directory.
    tests
        (name, role, number of samples) of each test.
    declared
        Effects that the campaign declares.
    sampling_rate_hz
        Sampling rate of the recordings.
    """

    campaign: str
    tests: Sequence[tuple[str, str, int]]
    declared: Sequence[str]
    sampling_rate_hz: float


def describe(sink: Sink, result: RecordedCampaign) -> None:
    """Write the section of `record` of the report."""
    rate = result.sampling_rate_hz
    seconds = sum(samples for _, _, samples in result.tests) / rate
    sink.text(
        f"The virtual laboratory recorded {len(result.tests)} tests ({seconds:.0f} s at {rate:g} Hz). Declared "
        f"effects: {', '.join(result.declared) or 'none'}. The rig's hidden effects are stored in "
        f"{result.campaign}.truth and are not read by any estimator."
    )
    rows = [{"test": name, "role": role, "seconds": samples / rate} for name, role, samples in result.tests]
    sink.table("tests", pd.DataFrame(rows), f"Tests of {result.campaign}.")
