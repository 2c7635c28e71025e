"""Division of the differences of repeated motion into noise of the channels and other forces.

White noise of a channel is visible in every sample, so the variances of the channels are the first estimate of the
variance of the differences. Few repeats cannot separate noise in the band of the motion, noise of the displacement and
a disturbance that grows with the speed. A factor other than 1 on the first estimate is therefore used only if the
differences require it, by the Bayesian information criterion (Schwarz 1978, Ann. Statist. 6, 461-464).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.rules import NoiseRules

LEAST_EXPECTED = 0.05
"""Numerical technique: least expected variance in the regression of the factors, as a share of the first estimate."""

WEIGHTED = 3
"""Numerical technique: number of passes of the regression, with weights from the pass before."""

MOST_DEVIATIONS = 2.0
"""Numerical technique: deviations beyond this multiple of the expected one are limited to it."""

UNLIMITED = 0.9205
"""Numerical technique: mean square of a normal variable limited to +-2, by which limited squares are corrected."""

NOISE_PASSES = 8
"""Numerical technique: number of passes of the robust regression; each may raise a part by a factor of four."""

MOST_LAGS = 50
"""Numerical technique: samples over which the correlation of neighbouring differences is summed."""

FREE = ((False, False), (True, False), (False, True), (True, True))
"""Numerical technique: for each model that is compared, whether the factors of force and motion noise are free."""


@dataclass(frozen=True)
class Differences:
    """Differences of the residual between repeats.

    Attributes
    ----------
    pieces
        Differences [N] of each pair of repeats, shape (m,) each.
    columns
        Variances of the differences due to force noise, motion noise, and a force that grows with the speed, shape
        (n, 3), the pieces end to end.
    step_squared
        Square of the largest difference that rounding alone can cause, shape (n,) [N^2].
    """

    pieces: tuple[FloatArray, ...]
    columns: FloatArray
    step_squared: FloatArray

    @property
    def squares(self) -> FloatArray:
        """Squared differences [N^2], shape (n,)."""
        return np.square(np.concatenate(self.pieces))

    def independent(self, expected: FloatArray) -> float:
        """Return the number of independent squared differences, for their expected values, shape (n,).

        The squares of a normal process with correlation rho have the correlation rho^2, which increases the variance of
        their mean by the factor 1 + 2 (sum of rho^2).
        """
        ends = np.cumsum([len(piece) for piece in self.pieces])
        lags = np.zeros(MOST_LAGS + 1)
        for piece, variance in zip(self.pieces, np.split(expected, ends[:-1]), strict=True):
            values = piece / np.sqrt(np.maximum(variance, 1e-300))
            for lag in range(min(MOST_LAGS + 1, len(values))):
                lags[lag] += float(values[: len(values) - lag] @ values[lag:])
        count = int(ends[-1])
        correlation = lags[1:] / max(lags[0], 1e-300)
        # the expected value by chance alone, 1 / n, is subtracted
        inflation = 1.0 + 2.0 * float(np.sum(np.maximum(correlation**2 - 1.0 / max(count, 1), 0.0)))
        return count / inflation


def parts_of_differences(found: Differences, rules: NoiseRules) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the factors of force and motion noise, the differences without events, and their disturbance part.

    Parameters
    ----------
    found
        Differences of repeated motion.
    rules
        Thresholds above which events and a disturbance are separated from the noise.
    """
    columns, target = found.columns, found.squares
    noise, nothing = columns[:, :2], np.zeros(len(target))
    with_growing = _factors(columns, target)
    count = found.independent(_expected(columns, with_growing))
    calm, cost = _required_factors(noise, target, count)
    # each squared difference is divided in proportion to what is expected of it
    expected = columns * with_growing
    growing = target * expected[:, 2] / np.maximum(expected.sum(axis=1), 1e-300)
    large = float(np.sum(growing)) >= rules.disturbance * float(np.sum(target))
    # if the noise of the channels is sufficient, the criterion must require a disturbance; otherwise its dependence on
    # the speed decides
    suffices = calm[0] <= 1.0
    growing_cost = _cost(target, _expected(columns, with_growing), columns.shape[1], count)
    if large and (growing_cost < cost or not suffices):
        return with_growing[:2], target, growing
    robust, limited = _robust_factors(noise, target, found.step_squared)
    if float(np.sum(target - limited)) > rules.events * float(np.sum(target)):
        return robust, limited, nothing
    return calm, target, nothing


def _required_factors(noise: FloatArray, target: FloatArray, count: float) -> tuple[FloatArray, float]:
    """Return the factors, different from 1 only if the differences require it, and the value of the criterion."""
    best = (np.ones(2), np.inf)
    for free in FREE:
        factors = _factors(noise, target, free)
        cost = _cost(target, _expected(noise, factors), sum(free), count)
        best = min(best, (factors, cost), key=lambda item: item[1])
    return best


def _factors(columns: FloatArray, target: FloatArray, free: Sequence[bool] = ()) -> FloatArray:
    """Return the factors of the columns that explain the squared differences; factors that are not free are 1.

    The scatter of squared differences is proportional to their mean, so they are weighted by the inverse of their mean.
    The search starts at the variances of the channels. Without `free` all factors are free.
    """
    searched = np.array(free) if free else np.ones(columns.shape[1], dtype=bool)
    factors = np.ones(columns.shape[1])
    factors[2:] = 0.0
    fixed = columns[:, ~searched].sum(axis=1)
    for _ in range(WEIGHTED if searched.any() else 0):
        weights = 1.0 / _expected(columns, factors)
        factors[searched] = optimize.nnls(columns[:, searched] * weights[:, None], (target - fixed) * weights)[0]
    return factors


def _expected(columns: FloatArray, factors: FloatArray) -> FloatArray:
    """Return the expected squares, at least a share of those of the channels alone."""
    together = columns[:, :2].sum(axis=1)
    # a channel without noise would have infinite weight
    least = np.maximum(LEAST_EXPECTED * together, max(1e-12 * float(np.max(together)), 1e-300))
    return np.asarray(np.maximum(columns @ factors, least))


def _cost(target: FloatArray, expected: FloatArray, fitted: int, count: float) -> float:
    """Return the information criterion of normal differences with these variances.

    Parameters
    ----------
    target, expected
        Squared differences, and their expected values, shape (n,).
    fitted
        Number of factors that were fitted.
    count
        Number of independent differences.
    """
    mean = float(np.mean(np.log(expected) + target / expected))
    return count * mean + fitted * float(np.log(max(count, 2.0)))


def _robust_factors(columns: FloatArray, target: FloatArray, step_squared: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the factors and the squared differences, both without single events.

    Noise affects all samples. A difference that exceeds its expected deviation several times in only a few samples is
    an event that does not repeat, such as sticking, and not noise. It is limited to a multiple of the expected
    deviation (proposal 2 of Huber 1964, Ann. Math. Statist. 35, 73-101). Rounding also causes few differences, of one
    step each; a difference of one step is not an event.
    """
    together = columns.sum(axis=1)
    # the search starts from the median, on which rare events have no influence
    middle = float(np.median(target / np.maximum(together, 1e-12 * float(np.max(together)))))
    start = max(middle / float(stats.chi2.median(1)), 1e-300)
    factors, limited, expected = np.full(2, start), target, start * together
    for _ in range(NOISE_PASSES):
        limited = np.minimum(target, MOST_DEVIATIONS**2 * np.maximum(expected, step_squared))
        weights = 1.0 / np.maximum(expected, 1e-12 * float(np.max(expected)))
        factors = optimize.nnls(columns * weights[:, None], limited * weights / UNLIMITED)[0]
        expected = np.maximum(columns @ factors, LEAST_EXPECTED * start * together)
    return factors, limited
