"""Errors of a damper model on tests, as every stage of the bench reports them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.model import DamperModel
from mrpipe.fitting.samples import settled
from mrpipe.signals.prepared import PreparedTest


@dataclass(frozen=True)
class TestScore:
    """Errors on one test, as sums from which pooled errors follow.

    Attributes
    ----------
    name, role
        The test.
    samples
        Number of samples that were compared.
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
    """Errors pooled over tests: NRMSE [1], fit 100 (1 - |f - fh|/|f - mean f|) [%] and R^2 [1]."""

    nrmse: float
    fit_percent: float
    r2: float


def score_tests(model: DamperModel, tests: Sequence[PreparedTest], *, raw_force: bool = False) -> tuple[TestScore, ...]:
    """Run the damper over whole tests, and compare forces after the model has settled."""
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
    """Return the pooled errors; NaN if there are no tests, and where the force is zero or constant."""
    nan = float("nan")
    if not scores:
        return PooledScore(nan, nan, nan)
    error = sum(item.squared_error for item in scores)
    force = sum(item.squared_force for item in scores)
    count = sum(item.samples for item in scores)
    varied = force - sum(item.force_sum for item in scores) ** 2 / count
    if not varied > 1e-12 * force:
        # a constant signal has no spread beyond rounding
        return PooledScore(float(np.sqrt(error / force)) if force > 0.0 else nan, nan, nan)
    share = error / varied
    return PooledScore(float(np.sqrt(error / force)), float(100.0 * (1.0 - np.sqrt(share))), float(1.0 - share))


@dataclass(frozen=True)
class Loop:
    """One test for a figure: name, displacement [m], velocity [m/s], measured and modelled force [N], shape (n,)."""

    name: str
    displacement: FloatArray
    velocity: FloatArray
    measured: FloatArray
    modelled: FloatArray


def shown_loops(model: DamperModel, tests: Sequence[PreparedTest], count: int = 4) -> list[Loop]:
    """Return the last part of a few validation tests, spread over the drive; of any tests if none validates."""
    held_out = [test for test in tests if test.role == "validation"] or list(tests)
    held_out.sort(key=lambda test: float(np.mean(np.abs(test.drive))))
    places = np.unique(np.linspace(0, len(held_out) - 1, count).round().astype(int))
    loops = []
    for test in (held_out[place] for place in places):
        force = model.force(test.displacement_m, test.velocity_m_s, test.acceleration_m_s2, test.drive, test.dt)
        last = _last_part(test)
        loops.append(
            Loop(test.name, test.displacement_m[last], test.velocity_m_s[last], test.force_n[last], force[last])
        )
    return loops


def _last_part(test: PreparedTest) -> slice:
    """Return the last two cycles, or the last second of random motion."""
    if len(test.cycles) >= 3:
        return slice(int(test.cycles[-3]), int(test.cycles[-1]))
    return slice(max(0, len(test.force_n) - round(test.sampling_rate_hz)), None)


def yield_curves(
    models: Sequence[tuple[str, DamperModel]], tests: Sequence[PreparedTest]
) -> tuple[FloatArray, list[tuple[str, FloatArray]]]:
    """Return drives, shape (60,), and name -> post-yield force [N] of each model at half the largest speed."""
    speed = 0.5 * max(float(np.abs(test.velocity_m_s).max()) for test in tests)
    drive = np.linspace(0.0, models[0][1].drive_limit, 60)
    return drive, [(name, model.quasi_static_force(speed, drive)) for name, model in models]
