"""Search for tests that are too short for the filters of the preparation."""

from __future__ import annotations

from mrpipe.campaigns import Campaign
from mrpipe.campaigns.plausibility.finding import Finding
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import common_rate, length_needed


def find_short_tests(campaign: Campaign, options: PreparationOptions) -> list[Finding]:
    """Return the tests of a bench campaign that are too short for the filters; `prepare` refuses them."""
    rate = options.working_rate_hz or common_rate([test.sampling_rate_hz for test in campaign.recordings])
    needed = length_needed(options, rate)
    findings = []
    for test in campaign.recordings:
        for begin, end in test.segments:
            duration = float(test.time_s[end - 1] - test.time_s[begin])
            samples = int(duration * rate + 1e-3) + 1
            if samples < needed:
                findings.append(
                    Finding(
                        name="too-short",
                        severity="error",
                        test=test.name,
                        sentence=f"has {samples} samples at the working rate of {rate:g} Hz, but the filters of "
                        f"prepare need {needed}",
                        remedy=f"give a segment of {needed / rate:.3g} s at least, or leave the test out",
                        numbers={"samples": float(samples), "samples_needed": float(needed)},
                    )
                )
    return findings
