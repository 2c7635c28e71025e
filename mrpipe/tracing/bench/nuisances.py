"""What is no physics of the damper: gains of records, and a moving average that the records went through."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.residual_structure import BLOCK_S

WINDOW_SHARES = (0.05, 0.1, 0.15)
LEAST_GAIN = 0.05
"""A filter, or a lag of the drive that falls otherwise than it rises, is believed in only if it takes this share of the
sum of squares."""


LEAST_DEVIATION = 0.03
"""Gains nearer to 1 than this are not worth a word."""

DECLARED_SHARE = 1.0 / 3.0
"""A session's gain is estimated from this first share of each of its records and judged on the rest."""

FEWEST_OF_A_SESSION = 3
"""So many records must agree on a gain before it is that of a session and not a record's own."""


@dataclass(frozen=True)
class RecordGain:
    """Factor that brings the simulated force of one test nearest to the measured one, with its 95 % interval."""

    value: float
    interval: tuple[float, float]

    @property
    def deviates(self) -> bool:
        """Return whether it is worth a word: away from 1, and surely so."""
        return abs(self.value - 1.0) > LEAST_DEVIATION and not self.interval[0] <= 1.0 <= self.interval[1]


def record_gains(
    recordings: Recordings, measured: FloatArray, simulated: FloatArray, part: BoolArray | None = None
) -> dict[str, RecordGain]:
    """Return the gain of each test.

    Parameters
    ----------
    recordings
        The tests.
    measured, simulated
        Offset-free force [N], shape (n,).
    part
        Samples to go by, shape (n,); all that are compared where left out.
    """
    found = {}
    for index, name in enumerate(recordings.names):
        own = np.flatnonzero(recordings.used & (recordings.test == index) & (True if part is None else part))
        power = float(simulated[own] @ simulated[own])
        if power <= 0.0:
            continue
        gain = float(measured[own] @ simulated[own]) / power
        block = (own - own[0]) // max(1, round(BLOCK_S / recordings.dt[index]))
        scores = np.bincount(block, weights=simulated[own] * (measured[own] - gain * simulated[own]))
        half = 1.96 * float(np.sqrt(scores @ scores)) / power
        found[name] = RecordGain(gain, (gain - half, gain + half))
    return found


@dataclass(frozen=True)
class SessionGain:
    """One factor on the force of several validation records: a load cell or damper that was otherwise that day.

    Attributes
    ----------
    value, interval
        From the first part of each record; 95 % interval by the spread over the records.
    tests
        The records that it applies to.
    spread_in_training
        Standard deviation of the gains of the training tests.
    without, with_it
        NRMSE over the rest of all validation records, which the estimate has not seen.
    """

    value: float
    interval: tuple[float, float]
    tests: tuple[str, ...]
    spread_in_training: float
    without: float
    with_it: float

    def as_json(self) -> dict[str, Any]:
        """Return what the summary says of it."""
        return {
            "value": self.value,
            "unit": "1",
            "interval": list(self.interval),
            "tests": list(self.tests),
            "estimated_from": f"the first {100.0 * DECLARED_SHARE:.0f} % of each record; errors are those of the rest",
            "spread_of_training_gains": self.spread_in_training,
            "nrmse_without": self.without,
            "nrmse_with": self.with_it,
        }


def session_gain(
    recordings: Recordings,
    measured: FloatArray,
    simulated: FloatArray,
    training: Mapping[str, RecordGain],
    levels: FloatArray | None = None,
) -> SessionGain | None:
    """Return the gain that validation records of one session share, or None where none is confirmed.

    It is confirmed where at least three records deviate to the same side by more than twice the spread of the training
    tests' gains, and agree among themselves to within half of what they deviate by.

    Parameters
    ----------
    recordings, measured, simulated
        Validation tests as in :func:`record_gains`, with the first parts of the records.
    training
        Gains of the training tests, by the same model.
    levels
        Mean drive of each training test: a record whose drive is none of these tells of the model between the levels,
        not of its session. Not looked at where left out.
    """
    first = recordings.time < DECLARED_SHARE * (np.diff(recordings.starts) * recordings.dt)[recordings.test]
    gains = record_gains(recordings, measured, simulated, first)
    if levels is not None:
        strange = _strange_to(recordings, levels)
        gains = {name: item for name, item in gains.items() if name not in strange}
    spread = float(np.std([item.value for item in training.values()])) if training else 0.0
    for side in (-1.0, 1.0):
        chosen = {name: g.value for name, g in gains.items() if g.deviates and side * (g.value - 1.0) > 2.0 * spread}
        if len(chosen) < FEWEST_OF_A_SESSION:
            continue
        values = np.array(list(chosen.values()))
        value = float(np.mean(values))
        deviation = float(np.std(values, ddof=1))
        if deviation > 0.5 * abs(value - 1.0):
            continue
        half = float(stats.t.ppf(0.975, len(values) - 1) * deviation / np.sqrt(len(values)))
        rest = recordings.used & ~first
        weaker = np.isin(recordings.test, [k for k, name in enumerate(recordings.names) if name in chosen])
        power = float(np.sqrt(np.mean(measured[rest] ** 2)))
        without, with_it = (
            float(np.sqrt(np.mean((measured - simulated * factor)[rest] ** 2))) / power
            for factor in (np.ones(len(measured)), np.where(weaker, value, 1.0))
        )
        return SessionGain(value, (value - half, value + half), tuple(chosen), spread, without, with_it)
    return None


def mean_drives(recordings: Recordings) -> FloatArray:
    """Return the mean drive of each test, shape (tests,)."""
    counts = np.maximum(np.bincount(recordings.test, minlength=recordings.tests), 1)
    return np.asarray(np.bincount(recordings.test, weights=recordings.drive, minlength=recordings.tests) / counts)


def _strange_to(recordings: Recordings, levels: FloatArray) -> set[str]:
    means = mean_drives(recordings)
    margin = 0.1 * max(float(np.max(np.abs(levels))), 1e-12)
    return {name for name, mean in zip(recordings.names, means, strict=True) if np.min(np.abs(levels - mean)) > margin}


def observation_window(found: Fit, shares: Sequence[float] = WINDOW_SHARES) -> tuple[float, Fit]:
    """Return the moving average (as share of each test's period) that suits the records, and the fit with it.

    The share is 0 and the fit the same where none is worth it. Displacement and force went through the same filter;
    what is left of it is that the force of the filtered motion is not the filtered force.
    """
    given = len(shares) == 1
    trials = {share: _with(found, share) for share in shares}
    best = min(trials, key=lambda share: trials[share].cost)
    if given:
        return best, trials[best]
    if trials[best].cost > (1.0 - LEAST_GAIN) * found.cost:
        return 0.0, found
    width = 0.02
    for _ in range(3):
        for share in (best - width, best + width):
            if share > 0.005 and share not in trials:
                trials[share] = _with(trials[best], share)
        best = min(trials, key=lambda share: trials[share].cost)
        width *= 0.5
    return best, trials[best]


def with_lag_apart(found: Fit) -> Fit:
    """Return the fit with rates of its own for the falling drive, or the same fit where that is not worth it."""
    base = found.problem.base
    if not base.lag_known or base.lag_apart:
        return found
    problem = replace(found.problem, base=replace(base, lag_apart=True))
    values = {**found.base_values, "eta_fall": found.base_values["eta"]}
    trial = fit(problem, start_of(problem, values, found.term_values), iterations=12)
    return trial if trial.cost < (1.0 - LEAST_GAIN) * found.cost else found


def _with(found: Fit, share: float) -> Fit:
    return fit(replace(found.problem, window_share=share), found.theta, iterations=6)
