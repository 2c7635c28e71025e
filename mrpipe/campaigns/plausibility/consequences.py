"""Findings on single tests that follow from a mistake in the whole campaign."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mrpipe.campaigns.plausibility.finding import Finding


def without_consequences(findings: Sequence[Finding]) -> list[Finding]:
    """Leave out findings on single tests that follow from a finding on the whole campaign.

    Where a channel is wrong in most tests, a test in which it is right differs from them. To correct this test, as its
    finding says, would be a second mistake.
    """
    exchanged = any(item.name == "channels-exchanged" and not item.test for item in findings)
    too_large = {
        item.channel
        for item in findings
        if item.name == "unit-range" and not item.test
        and item.numbers.get("amplitude_si", 0.0) > item.numbers.get("largest_si", math.inf)
    }  # fmt: skip

    def follows(item: Finding) -> bool:
        if not item.test:
            return False
        small = item.name == "unit-decades" and item.numbers.get("factor_to_correct", 1.0) > 1.0
        return (exchanged and item.name == "channels-exchanged") or (small and item.channel in too_large)

    return [item for item in findings if not follows(item)]
