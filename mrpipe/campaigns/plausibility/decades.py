"""Tests whose stroke, force or drive differs by orders of magnitude from the others, because a unit is wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.campaigns.plausibility.finding import Finding
from mrpipe.campaigns.plausibility.reference import Slow

DECADES = 100.0
"""Ratio of RMS force or drive between a test and all others from which a unit is suspected by itself."""

RELATED = 0.3
"""Correlation of force and velocity below which a test with very small motion is one at rest."""

LARGE_DRIVE = 20.0
"""Drive [A or V] above which milliamperes or millivolts are suspected."""


def find_decades(tests: Sequence[Slow]) -> list[Finding]:
    """Return tests whose stroke, force or drive differs by orders of magnitude from most others.

    The tests are divided at the widest gap between their values. If it spans orders of magnitude, the smaller group is
    named. Of groups of equal size the one with larger values is named, because the data do not show which group is
    wrong. A drive can be zero in a test, so only a drive that is far larger than all others is suspected.
    """
    findings = []
    for channel, decades in (("displacement", 3.0 * DECADES), ("force", DECADES), ("drive", DECADES)):
        sizes = np.array([float(np.sqrt(np.mean(getattr(test, channel) ** 2))) for test in tests])
        order = [index for index in np.argsort(sizes) if sizes[index] > 0.0]
        if len(order) < 2:
            continue
        ratios = sizes[order[1:]] / sizes[order[:-1]]
        cut = int(np.argmax(ratios)) + 1
        ratio = float(ratios[cut - 1])
        large = channel == "drive" or len(order) - cut <= cut
        named = order[cut:] if large else order[:cut]
        # a drive near zero is noise, so ratios alone carry no information
        suspect = channel != "drive" or (sizes[order[cut]] > LARGE_DRIVE and len(order) - cut <= cut)
        if not suspect or ratio <= decades:
            continue
        times = ratio if large else 1.0 / ratio
        evidence = f"the RMS is {times:.3g} times that of the nearest of the {len(order) - len(named)} others"
        for index in sorted(named):
            findings.append(unit_finding(tests[index], channel, 1e-3 if large else 1e3, evidence, {"ratio": times}))
    small = {item.test for item in findings if item.channel == "displacement" and item.numbers["ratio"] < 1.0}
    resting = [test for test in tests if test.name in small and abs(test.work) < RELATED]
    kept = [item for item in findings if item.test not in {test.name for test in resting}]
    return [*kept, *(_at_rest(test) for test in resting)]


def _at_rest(test: Slow) -> Finding:
    """Return the finding that nothing moves in a test."""
    travel, force = float(np.std(test.displacement)), float(np.std(test.force))
    return Finding(
        name="at-rest",
        severity="warning",
        test=test.name,
        channel="displacement",
        sentence=f"the rod does not move (RMS {1e3 * travel:.2g} mm), and the force (RMS {force:.3g} N about its mean) "
        "does not follow it",
        remedy="leave the test out, because it does not show what the damper does",
        numbers={"displacement_m": travel, "force_n": force},
    )


def unit_finding(test: Slow, channel: str, factor: float, evidence: str, numbers: dict[str, float]) -> Finding:
    """Return the finding that the unit of a channel is wrong; `factor` corrects it."""
    wrong = "small" if factor > 1.0 else "large"
    return Finding(
        name="unit-decades",
        severity="error",
        test=test.name,
        channel=channel,
        sentence=f"{channel} looks 1000 times too {wrong} compared with the other tests ({evidence})",
        remedy=f"correct the unit of {channel} in this test",
        numbers={**numbers, "factor_to_correct": factor},
    )
