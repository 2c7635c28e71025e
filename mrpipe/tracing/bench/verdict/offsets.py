"""Whether the zero of the load cell moves between tests, from the fitted offsets of the tests."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit, fit
from mrpipe.tracing.bench.verdict.naming import Named
from mrpipe.tracing.rules import OffsetRules
from mrpipe.tracing.verdict import Estimate, Interval


@dataclass(frozen=True)
class OffsetFinding:
    """Offsets that differ between tests.

    Attributes
    ----------
    effect
        The effect `offset` of the library.
    spread_n, interval
        Standard deviation of the offsets, and its 95 % interval [N].
    evidence
        Gain of the log-likelihood by one offset for each test, compared with one offset for all tests.
    share
        Spread over the RMS force [1].
    confidence
        Probability that the zero moves between tests.
    """

    effect: Effect
    spread_n: float
    interval: tuple[float, float]
    evidence: float
    share: float
    confidence: float

    def as_named_effect(self) -> Named:
        """Return the finding as an effect of the verdict."""
        table = {"spread": Estimate(self.spread_n, "N", Interval(*self.interval))}
        return Named(self.effect, "per-test", table, self.confidence)


def offset_between_tests(
    found: Fit, effect: Effect | None, *, least_ratio: float = 0.0, rules: OffsetRules | None = None
) -> OffsetFinding | None:
    """Compare one offset for all tests with one for each test; return None if the zero is steady.

    Parameters
    ----------
    found
        The final fit, with an offset for each test.
    effect
        The effect `offset` of the library; None: it is not considered.
    least_ratio
        Least spread of the offsets, in multiples of the RMS residual force.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or OffsetRules()
    if effect is None or found.problem.recordings.tests < rules.fewest_tests:
        return None
    common = fit(replace(found.problem, offsets=False), found.theta, iterations=4)
    rms = found.problem.recordings.force_rms
    spread = float(np.std(found.test_offsets, ddof=1))
    excess = (common.chi_square - found.chi_square) / max(found.chi_square, 1e-12)
    if spread < rules.least_spread * rms or excess < rules.least_excess:
        return None
    root = found.problem.root_weight
    used = root > 0.0
    if spread < least_ratio * float(np.sqrt(np.mean((found.residual[used] / root[used]) ** 2))):
        return None
    half = 1.96 * spread / np.sqrt(2.0 * found.problem.recordings.tests)
    evidence = 0.5 * (common.cost - found.cost)
    return OffsetFinding(effect, spread, (spread - half, spread + half), evidence, spread / rms, rules.confidence)
