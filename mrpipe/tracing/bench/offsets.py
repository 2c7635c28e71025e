"""Does the zero of the load cell move from test to test: told by the offsets that the records ask for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit, fit
from mrpipe.tracing.bench.verdict import Named

LEAST_SPREAD_SHARE = 0.01
"""Spread of the offsets over the force RMS below which the zero is steady."""

LEAST_EXCESS = 0.2
"""Excess of the chi-square with one offset for all, in units of the noise-like residual, that makes it an effect."""


@dataclass(frozen=True)
class OffsetFinding:
    """Offsets that differ between tests."""

    effect: Effect
    spread_n: float
    interval: tuple[float, float]
    evidence: float
    share: float

    def named(self) -> Named:
        """Return it as an effect of the verdict."""
        table = {"spread": {"value": self.spread_n, "unit": "N", "interval": list(self.interval)}}
        return Named(self.effect, "per-test", table, 0.97)


def offset_between_tests(found: Fit, effect: Effect | None, *, least_ratio: float = 0.0) -> OffsetFinding | None:
    """Compare one offset for all tests with one for each; None where the zero is steady.

    Parameters
    ----------
    found
        The final fit, with an offset for each test.
    effect
        The effect `offset` of the library; None where it is not considered.
    least_ratio
        Least spread of the offsets, in RMS of what the fit leaves of the force.
    """
    if effect is None or found.problem.recordings.tests < 4:
        return None
    common = fit(replace(found.problem, offsets=False), found.theta, iterations=4)
    rms = found.problem.recordings.force_rms
    spread = float(np.std(found.test_offsets, ddof=1))
    excess = (common.chi_square - found.chi_square) / max(found.chi_square, 1e-12)
    if spread < LEAST_SPREAD_SHARE * rms or excess < LEAST_EXCESS:
        return None
    root = found.problem.root_weight
    used = root > 0.0
    if spread < least_ratio * float(np.sqrt(np.mean((found.residual[used] / root[used]) ** 2))):
        return None
    half = 1.96 * spread / np.sqrt(2.0 * found.problem.recordings.tests)
    return OffsetFinding(effect, spread, (spread - half, spread + half), 0.5 * (common.cost - found.cost), spread / rms)
