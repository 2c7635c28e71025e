"""How well a damper does on tests: errors as every stage of the bench reports them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.samples import settled
from mrpipe.signals.prepared import PreparedTest


@dataclass(frozen=True)
class TestScore:
    """One test: sums from which pooled figures follow, and the figures of its own.

    Attributes
    ----------
    name, role
        The test.
    samples
        How many were compared.
    squared_error, squared_force, force_sum
        Sums over the samples [N^2, N^2, N].
    """

    __test__ = False

    name: str
    role: str
    samples: int
    squared_error: float
    squared_force: float
    force_sum: float

    @property
    def nrmse(self) -> float:
        """RMS error over RMS force."""
        return float(np.sqrt(self.squared_error / self.squared_force)) if self.squared_force > 0 else float("nan")


@dataclass(frozen=True)
class PooledScore:
    """Figures pooled over tests: NRMSE, fit 100 (1 - |f - fh|/|f - mean f|) and R^2."""

    nrmse: float
    fit_percent: float
    r2: float


def score_tests(model: DamperModel, tests: Sequence[PreparedTest], *, raw_force: bool = False) -> tuple[TestScore, ...]:
    """Run the damper over whole tests and compare forces once the model has settled."""
    scores = []
    for test in tests:
        predicted = model.force(test.displacement_m, test.velocity_m_s, test.acceleration_m_s2, test.drive, test.dt)
        scores.append(score(test, predicted, raw_force=raw_force))
    return tuple(scores)


def score(test: PreparedTest, predicted: FloatArray, *, raw_force: bool = False) -> TestScore:
    """Compare a predicted force, shape (n,) [N], with that of a test."""
    usable = settled(test.displacement_m)
    force = (test.force_raw_n if raw_force else test.force_n)[usable]
    error = force - predicted[usable]
    return TestScore(
        name=test.name,
        role=test.role,
        samples=len(force),
        squared_error=float(error @ error),
        squared_force=float(force @ force),
        force_sum=float(force.sum()),
    )


def pool(scores: Sequence[TestScore]) -> PooledScore:
    """Return the pooled figures; not a number where there are no tests."""
    if not scores:
        return PooledScore(float("nan"), float("nan"), float("nan"))
    error = sum(item.squared_error for item in scores)
    force = sum(item.squared_force for item in scores)
    count = sum(item.samples for item in scores)
    varied = force - sum(item.force_sum for item in scores) ** 2 / count
    share = error / varied
    return PooledScore(float(np.sqrt(error / force)), float(100.0 * (1.0 - np.sqrt(share))), float(1.0 - share))
