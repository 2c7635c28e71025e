"""Checks whether the numbers of a campaign can be what campaign.yaml says they are."""

from mrpipe.campaigns.plausibility.compare_tests import compare_tests
from mrpipe.campaigns.plausibility.finding import Finding, TestArrays, arrays_of
from mrpipe.campaigns.plausibility.library import Check, all_checks, judge

__all__ = ["Check", "Finding", "TestArrays", "all_checks", "arrays_of", "compare_tests", "judge"]
