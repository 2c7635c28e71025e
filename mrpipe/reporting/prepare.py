"""Section of the report: the prepared tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from mrpipe.campaigns import Campaign
from mrpipe.reporting.signals import loops, prepared_history, spectra_before_and_after
from mrpipe.reporting.sink import Sink
from mrpipe.signals.preparation import Preparation
from mrpipe.signals.spectra import power_spectrum

_SHOWN_TESTS = 3


@dataclass(frozen=True)
class PreparedCampaign:
    """Tests of a campaign after `prepare`, for the report.

    Attributes
    ----------
    campaign
        The measured campaign.
    preparations
        The prepared tests.
    rows
        Row of each test (:func:`mrpipe.signals.summary.preparation_row`).
    """

    campaign: Campaign
    preparations: Sequence[Preparation]
    rows: Sequence[Mapping[str, Any]]


def describe(sink: Sink, result: PreparedCampaign) -> None:
    """Write the section of `prepare` of the report."""
    campaign, preparations = result.campaign, result.preparations
    rows = [dict(row) for row in result.rows]
    random = sum(row["excitation"] == "random" for row in rows)
    sink.text(
        f"{len(rows)} tests of the campaign {campaign.name}, {len(rows) - random} periodic and {random} random, at "
        f"{preparations[0].test.sampling_rate_hz:g} Hz."
    )
    cutoffs = pd.DataFrame([row.pop("cutoffs_hz") for row in rows]).add_suffix("_cutoff_hz")
    sink.table("tests", pd.concat([pd.DataFrame(rows), cutoffs], axis=1), "The prepared tests.")
    shown = preparations[len(preparations) // 2]
    units = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s²", "force": "N", "drive": campaign.drive_unit}
    spectra, before, after = _channels(shown)
    sink.figure(
        "spectra",
        spectra_before_and_after(spectra, units, shown.cutoffs_hz),
        f"Power spectra before and after, test {shown.test.name}.",
    )
    sink.figure(
        "history",
        prepared_history(shown.test.time_s, before, after, units, shown.test.cycles),
        f"Channels before and after, test {shown.test.name}.",
    )
    step = max(1, len(preparations) // _SHOWN_TESTS)
    chosen = [item.test for item in preparations[::step][:_SHOWN_TESTS]]
    parts = [slice(int(test.cycles[0]), int(test.cycles[-1])) if test.cycles.size else slice(None) for test in chosen]
    sink.figure(
        "loops",
        loops(
            [
                (test.name, test.displacement_m[part], test.velocity_m_s[part], test.force_n[part])
                for test, part in zip(chosen, parts, strict=True)
            ]
        ),
        "Force over displacement and over velocity.",
    )


def _channels(item: Preparation) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return spectra, channels before and channels after of one test."""
    test = item.test
    after = {
        "displacement": test.displacement_m,
        "velocity": test.velocity_m_s,
        "acceleration": test.acceleration_m_s2,
        "force": test.force_n,
        "drive": test.drive,
    }
    before = {name: item.before[name] for name in after if name in item.before}
    rate = test.sampling_rate_hz
    spectra = {
        name: (power_spectrum(values, rate), power_spectrum(after[name], rate))
        for name, values in before.items()
        if values.max() > values.min()
    }
    return spectra, before, after
