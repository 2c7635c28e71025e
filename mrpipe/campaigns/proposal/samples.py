"""What samples alone show: the pair of motion and force, and channels that rest on a few levels."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.plausibility.reference import mean_frequency

SHARE_OF_PERIOD = 0.05
"""Numerical technique: interval of a finite difference over the mean period of a channel."""


def motion_and_force(columns: Sequence[FloatArray]) -> tuple[int, int]:
    """Return the places of the two columns, shape (n,) each, of which one follows the derivative of the other best.

    The force of a damper follows the velocity, so these two are displacement and force, in either order.
    """
    return max(
        combinations(range(len(columns)), 2),
        key=lambda pair: max(
            _follows(columns[pair[0]], columns[pair[1]]), _follows(columns[pair[1]], columns[pair[0]])
        ),
    )


def _follows(cause: FloatArray, effect: FloatArray) -> float:
    """Return the magnitude of the correlation of a column with the derivative of another."""
    x, y = np.nan_to_num(cause), np.nan_to_num(effect)
    # over a share of the mean period, so that the noise of single samples does not drown the velocity
    period = 1.0 / max(mean_frequency(x, 1.0), 1e-9)
    width = int(np.clip(SHARE_OF_PERIOD * period, 1, max(x.size // 50, 1)))
    velocity = x[width:] - x[:-width]
    middle = y[width // 2 : width // 2 + velocity.size]
    if np.ptp(velocity) == 0.0 or np.ptp(middle) == 0.0:
        return 0.0
    return float(abs(np.corrcoef(velocity, middle)[0, 1]))


def has_few_levels(values: FloatArray) -> bool:
    """Return whether samples rest on a few levels: half of them lie within 1 % of the range of at most three values."""
    span = float(np.ptp(values))
    if span <= 0.02 * float(np.abs(values).max()):
        return True
    counts = np.sort(np.histogram(values, bins=100)[0])[::-1]
    return bool(counts[:3].sum() > 0.9 * values.size)
