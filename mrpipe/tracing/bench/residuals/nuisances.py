"""Artefacts of the measurement: gains of single records and of sessions, and a moving average by the recorder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.error_size import rms
from mrpipe.tracing.bench.residuals.residual_structure import BLOCK
from mrpipe.tracing.rules import NuisanceRules, ValidationRules
from mrpipe.words import in_percent

WINDOW_SHARES = (0.05, 0.1, 0.15)
"""Numerical technique: lengths of a moving average that are tried first, as shares of a period."""

FIRST_STEP, LEAST_WINDOW = 0.02, 0.005
"""Numerical technique: first step of the search for the length, and the shortest length, as shares of a period."""


@dataclass(frozen=True)
class RecordGain:
    """Factor on the simulated force of one test that minimises the error.

    Attributes
    ----------
    value, interval
        The factor [1] and its 95 % interval.
    least
        Least difference from 1 that is reported.
    """

    value: float
    interval: tuple[float, float]
    least: float = ValidationRules().deviation

    @property
    def deviates(self) -> bool:
        """Return whether the gain differs from 1 by more than `least`, and 1 lies outside its interval."""
        return abs(self.value - 1.0) > self.least and not self.interval[0] <= 1.0 <= self.interval[1]


def record_gains(
    recordings: Recordings,
    measured: FloatArray,
    simulated: FloatArray,
    part: BoolArray | None = None,
    least: float = ValidationRules().deviation,
) -> dict[str, RecordGain]:
    """Return the gain of each test.

    Parameters
    ----------
    recordings
        The tests.
    measured, simulated
        Offset-free force [N], shape (n,).
    part
        Samples that are used, shape (n,) of bool; None: all samples that are compared.
    least
        Least difference from 1 that is reported.
    """
    found = {}
    blocks = recordings.blocks(BLOCK)
    for index, name in enumerate(recordings.names):
        own = np.flatnonzero(recordings.used & (recordings.test == index) & (True if part is None else part))
        power = float(simulated[own] @ simulated[own])
        if power <= 0.0:
            continue
        gain = float(measured[own] @ simulated[own]) / power
        scores = np.bincount(
            blocks[own] - blocks[own[0]], weights=simulated[own] * (measured[own] - gain * simulated[own])
        )
        half = 1.96 * float(np.sqrt(scores @ scores)) / power
        found[name] = RecordGain(gain, (gain - half, gain + half), least)
    return found


@dataclass(frozen=True)
class SessionGain:
    """One factor on the force of several validation records, because the load cell or the damper has changed.

    Attributes
    ----------
    value, interval
        Gain, from the first part of each record, and its 95 % interval from the spread over the records.
    tests
        Names of the records that it applies to.
    spread_in_training
        Standard deviation of the gains of the training tests.
    without, with_it
        NRMSE without and with the gain, over the rest of all validation records, which the estimate has not used.
    first_part
        Share of each record from which the gain is estimated.
    """

    value: float
    interval: tuple[float, float]
    tests: tuple[str, ...]
    spread_in_training: float
    without: float
    with_it: float
    first_part: float = ValidationRules().first_part

    def as_json(self) -> dict[str, Any]:
        """Return the gain as JSON."""
        return {
            "value": self.value,
            "unit": "1",
            "interval": list(self.interval),
            "tests": list(self.tests),
            "estimated_from": f"the first {in_percent(self.first_part)} of each record; errors are those of the rest",
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
    rules: NuisanceRules | None = None,
    validation: ValidationRules | None = None,
) -> SessionGain | None:
    """Return the gain that validation records of one session share, or None if none is confirmed.

    It is confirmed if enough records deviate in the same direction by more than the spread of the gains of the training
    tests, and if their gains agree.

    Parameters
    ----------
    recordings, measured, simulated
        Validation tests as in :func:`record_gains`, with the first parts of the records.
    training
        Gains of the training tests, by the same model.
    levels
        Mean drive of each training test [A or V]. A record at another drive is skipped, because its gain depends on the
        interpolation of the model between the levels. None: all records are used.
    rules, validation
        Decision thresholds; their defaults if None.
    """
    rules, validation = rules or NuisanceRules(), validation or ValidationRules()
    first = recordings.time < validation.first_part * (np.diff(recordings.starts) * recordings.dt)[recordings.test]
    gains = record_gains(recordings, measured, simulated, first, validation.deviation)
    if levels is not None:
        strange = _strange_to(recordings, levels, validation.level)
        gains = {name: item for name, item in gains.items() if name not in strange}
    spread = float(np.std([item.value for item in training.values()])) if training else 0.0
    for side in (-1.0, 1.0):
        away = {name: side * (gain.value - 1.0) for name, gain in gains.items() if gain.deviates}
        chosen = {name: gains[name].value for name, distance in away.items() if distance > rules.spreads * spread}
        if len(chosen) < rules.fewest_of_session:
            continue
        values = np.array(list(chosen.values()))
        value = float(np.mean(values))
        deviation = float(np.std(values, ddof=1))
        if deviation > rules.agreement * abs(value - 1.0):
            continue
        half = float(stats.t.ppf(0.975, len(values) - 1) * deviation / np.sqrt(len(values)))
        rest = recordings.used & ~first
        weaker = np.isin(recordings.test, [k for k, name in enumerate(recordings.names) if name in chosen])
        power = rms(measured[rest])
        without, with_it = (
            rms((measured - simulated * factor)[rest]) / power
            for factor in (np.ones(len(measured)), np.where(weaker, value, 1.0))
        )
        interval = (value - half, value + half)
        return SessionGain(value, interval, tuple(chosen), spread, without, with_it, validation.first_part)
    return None


def session_of(
    recorded: Recordings,
    measured: FloatArray,
    simulated: FloatArray,
    chosen: Fit,
    training: Recordings,
    rules: NuisanceRules,
    validation: ValidationRules,
) -> SessionGain | None:
    """Return the gain that validation records share, compared with the gains of the training tests by the same fit.

    Parameters
    ----------
    recorded, measured, simulated
        Validation tests with all samples, their offset-free force and the simulated one [N], shape (n,).
    chosen
        Fit to the training tests.
    training
        The training tests.
    rules, validation
        Decision thresholds.
    """
    root = chosen.problem.root_weight
    force = training.force - chosen.test_offsets[training.test]
    residual = np.divide(chosen.residual, root, out=np.zeros_like(root), where=root > 0.0)
    gains = record_gains(training, force, force - residual)
    return session_gain(recorded, measured, simulated, gains, mean_drives(training), rules, validation)


def mean_drives(recordings: Recordings) -> FloatArray:
    """Return the mean drive of each test, shape (tests,)."""
    counts = np.maximum(np.bincount(recordings.test, minlength=recordings.tests), 1)
    return np.asarray(np.bincount(recordings.test, weights=recordings.drive, minlength=recordings.tests) / counts)


def _strange_to(recordings: Recordings, levels: FloatArray, share: float) -> set[str]:
    means = mean_drives(recordings)
    margin = share * max(float(np.max(np.abs(levels))), 1e-12)
    return {name for name, mean in zip(recordings.names, means, strict=True) if np.min(np.abs(levels - mean)) > margin}


def observation_window(
    found: Fit, shares: Sequence[float] = WINDOW_SHARES, rules: NuisanceRules | None = None, *, jobs: int = 1
) -> tuple[float, Fit]:
    """Return the length of a moving average by the recorder (as a share of the period), and the fit with it.

    The share is 0 and the fit is unchanged if no moving average lowers the error enough. Displacement and force went
    through the same filter. The filter is visible, because the force of the filtered motion differs from the filtered
    force.
    """
    least = (rules or NuisanceRules()).least_gain
    given = len(shares) == 1
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        trials = dict(zip(shares, pool.map(partial(_with, found), shares), strict=True))
    best = min(trials, key=lambda share: trials[share].cost)
    if given:
        return best, trials[best]
    if trials[best].cost > (1.0 - least) * found.cost:
        return 0.0, found
    width = FIRST_STEP
    for _ in range(3):
        for share in (best - width, best + width):
            if share > LEAST_WINDOW and share not in trials:
                trials[share] = _with(trials[best], share)
        best = min(trials, key=lambda share: trials[share].cost)
        width *= 0.5
    return best, trials[best]


def with_lag_apart(found: Fit, rules: NuisanceRules | None = None) -> Fit:
    """Return the fit with a separate lag for a falling drive, or the same fit if the error hardly falls."""
    least = (rules or NuisanceRules()).least_gain
    base = found.problem.base
    if not base.lag_known or base.lag_apart:
        return found
    problem = replace(found.problem, base=replace(base, lag_apart=True))
    values = {**found.base_values, "eta_fall": found.base_values["eta"]}
    trial = fit(problem, start_of(problem, values, found.term_values), iterations=12)
    return trial if trial.cost < (1.0 - least) * found.cost else found


def _with(found: Fit, share: float) -> Fit:
    return fit(replace(found.problem, window_share=share), found.theta, iterations=6)
