"""Comparison of the tests of a bench campaign with each other."""

from __future__ import annotations

from mrpipe.campaigns.model import Campaign
from mrpipe.campaigns.plausibility.compare_tests import compare_tests
from mrpipe.campaigns.plausibility.finding import Finding, arrays_of
from mrpipe.campaigns.plausibility.library import Check


def _judge(campaign: Campaign) -> tuple[Finding, ...]:
    return compare_tests([arrays_of(test) for test in campaign.recordings])


CHECK = Check("bench-tests", _judge, rigs=("damper-bench",))
