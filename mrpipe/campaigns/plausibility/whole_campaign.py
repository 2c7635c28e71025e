"""Mistakes that most tests of a campaign share, so that comparing its tests does not show them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import detrend

from mrpipe.campaigns.plausibility.agreement import fit
from mrpipe.campaigns.plausibility.finding import Finding, TestArrays
from mrpipe.campaigns.plausibility.reference import ReferenceMap, Slow, moving_tests

EXCHANGED = 1.05
"""Mean frequency of displacement over that of force above which the two look exchanged."""

UNRELATED = 0.3
"""Correlation with the predicted force below which a force is unrelated to the motion."""


def find_exchanged_columns(arrays: Sequence[TestArrays]) -> list[Finding]:
    """Return a finding where displacement and force look exchanged in most tests of a campaign."""
    tests = moving_tests(arrays)
    ratios = [test.frequency_ratio for test in tests]
    if not ratios or float(np.median(ratios)) <= EXCHANGED:
        return []
    return [
        Finding(
            name="channels-exchanged",
            severity="error",
            sentence="displacement and force look exchanged: the displacement holds higher frequencies than the force "
            f"(mean frequency {float(np.median(ratios)):.2f} times that of the force), but a damper distorts its force",
            remedy="exchange the columns of displacement and force in campaign.yaml",
            numbers={"frequency_ratio": float(np.median(ratios))},
        )
    ]


def find_unrelated_force(arrays: Sequence[TestArrays]) -> list[Finding]:
    """Return a finding where the force follows the motion in no test of a campaign.

    A flexible map from motion and drive to force is fitted to the first half of all tests and compared with their
    second halves. The force of a damper correlates with it; that of a load cell that shows noise does not.
    """
    tests = moving_tests(arrays)
    if not tests:
        return []
    halves = [_without_drift(test.part(0.0, 0.5)) for test in tests]
    halves += [_without_drift(test.part(0.5, 1.0)) for test in tests]
    reference = ReferenceMap(halves)
    coefficients = reference.coefficients(range(len(tests), len(halves)))
    correlations = [fit(part, coefficients)[1] for part in reference.parts[len(tests) :]]
    highest = max(correlations)
    if highest > UNRELATED:
        return []
    return [
        Finding(
            name="force-unrelated",
            severity="error",
            channel="force",
            sentence=f"force follows the motion in no test: its correlation with what displacement, velocity and drive "
            f"predict is {highest:.2f} at most",
            remedy="check the load cell, its cable and amplifier, and the columns of force and displacement",
            numbers={"highest_correlation": highest, "tests": float(len(tests))},
        )
    ]


def _without_drift(test: Slow) -> Slow:
    """Return the test without the linear trend of its force, where the motion has at least one cycle to show."""
    cycles = test.frequency_hz * test.interval_s * test.force.size
    return replace(test, force=np.asarray(detrend(test.force))) if cycles >= 1.0 else test
