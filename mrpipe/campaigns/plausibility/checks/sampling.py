"""Whether the clock can be in the unit that campaign.yaml gives it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.plausibility.finding import Finding
from mrpipe.campaigns.plausibility.library import Check
from mrpipe.campaigns.plausibility.reference import mean_frequency

RATES_HZ = (15.0, 200e3)
"""Plausible sampling rates of vibration measurements."""

MOTIONS_HZ = {"damper-bench": (0.002, 200.0), "shear-frame": (0.01, 500.0)}
"""Plausible mean frequencies of the motion, by rig."""

AT_REST = 1.0 / 300.0
"""Range of the displacement, over that of the largest test of a bench, below which a test is at rest."""


def _judge(campaign: Campaign) -> Iterator[Finding]:
    low, high = RATES_HZ
    slow = [test for test in campaign.recordings if test.sampling_rate_hz < low]
    fast = [test for test in campaign.recordings if test.sampling_rate_hz > high]
    for tests, word, guess in ((slow, "low", "milliseconds given as seconds"), (fast, "high", "seconds given as ms")):
        if tests:
            rate = tests[0].sampling_rate_hz
            yield _finding(
                campaign,
                tests,
                f"a sampling rate of {rate:.4g} Hz is implausibly {word} for vibration measurements",
                f"correct the unit of time or sampling_rate_hz ({guess}?)",
                {"sampling_rate_hz": rate},
            )
    if slow or fast:
        return
    low, high = MOTIONS_HZ[campaign.rig]
    spans = {test.name: _span(test, campaign.rig) for test in campaign.recordings}
    # the noise of a test at rest has no frequency of a motion
    resting = {name for name, span in spans.items() if span < AT_REST * max(spans.values())}
    frequencies = {
        test.name: 0.0 if test.name in resting else _frequency(test, campaign.rig) for test in campaign.recordings
    }
    odd = [test for test in campaign.recordings if frequencies[test.name] and not low <= frequencies[test.name] <= high]
    if odd:
        frequency = frequencies[odd[0].name]
        yield _finding(
            campaign,
            odd,
            f"a motion of {frequency:.3g} Hz (mean frequency) is implausible (plausible: {low:g} to {high:g} Hz)",
            "correct the unit of time or sampling_rate_hz",
            {"frequency_hz": frequency},
        )


def _span(test: Recording, rig: str) -> float:
    return float(np.ptp(test.used("displacement"))) if rig == "damper-bench" else 1.0


def _frequency(test: Recording, rig: str) -> float:
    channel = "displacement" if rig == "damper-bench" else next(iter(test.channels), "")
    values = test.used(channel) if channel else np.zeros(0)
    return mean_frequency(values, test.sampling_rate_hz) if values.size > 50 and np.ptp(values) > 0.0 else 0.0


def _finding(
    campaign: Campaign, tests: list[Recording], sentence: str, remedy: str, numbers: dict[str, float]
) -> Finding:
    several = len(tests) > 1
    return Finding(
        name="clock-unit",
        severity="error",
        test="" if several else tests[0].name,
        channel="time",
        sentence=f"{sentence}, in {len(tests)} of {len(campaign.recordings)} tests" if several else sentence,
        remedy=remedy,
        numbers={**numbers, "tests": float(len(tests))},
    )


CHECK = Check("sampling", _judge)
