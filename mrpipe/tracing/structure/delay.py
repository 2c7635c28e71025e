"""Dead time of the controller: between desired force and drive, and between law and desired force.

A controller samples, filters and holds its command. The resulting lag is expected and called the granted lag. The drive
is predicted from desired force and velocity at an earlier time, by a table that is fitted to the training tests. The
desired force is predicted by its law: it is a linear function of velocity and displacement where it is not clipped. The
lag is the time shift with the smallest error of this prediction on the validation tests.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.laws import is_linear
from mrpipe.tracing.rules import DelayRules

STEP_PERIODS = 0.00125
"""Numerical technique: step of the search for the lag, in mean periods of the motion."""

COARSE = 4
"""Numerical technique: the search starts with every fourth step."""

FITTED = 4
"""Numerical technique: least number of shifts to which a parabola is fitted."""

BINS = (16, 10)
"""Numerical technique: number of bins of the table in desired force and in velocity."""


@dataclass(frozen=True)
class LoopSignals:
    """A closed-loop test on its recorded clock; SI, shape (m,) each.

    `displacement` and `velocity` are those of the damper, relative to the ground. `gains` are those of the law on
    velocity [N s/m] and displacement [N/m]; None if the campaign does not state them. `controller_rate_hz` and
    `command_filter_hz` (cutoff of a second-order low-pass on the command) are 0 if the campaign does not state them.
    """

    name: str
    role: str
    rate_hz: float
    displacement: FloatArray
    velocity: FloatArray
    drive: FloatArray
    desired: FloatArray
    controller_rate_hz: float = 0.0
    gains: tuple[float, float] | None = None
    command_filter_hz: float = 0.0

    @property
    def period_s(self) -> float:
        """Mean period of the motion [s], from the RMS of displacement and velocity."""
        return float(2.0 * np.pi * np.std(self.displacement) / max(float(np.std(self.velocity)), 1e-12))


@dataclass(frozen=True)
class DelayFinding:
    """Lag of one part of the controller.

    Attributes
    ----------
    part
        `drive-late` or `law-late`.
    lag_s, granted_s
        Shift of least error, and the part of it that sampling and filters explain [s].
    before, after
        Error on validation tests over the RMS of the signal, without and with the dead time beyond what is granted.
    interval_s
        Interval of the lag [s].
    least_s
        Least dead time beyond the granted lag that is reported [s].
    better
        Ratio of the errors below which the lag is reported.
    granted_error_s
        Uncertainty of `granted_s` [s]: all of it where the campaign does not declare the controller, else 0.
    """

    part: str
    lag_s: float
    granted_s: float
    before: float
    after: float
    interval_s: tuple[float, float]
    least_s: float
    better: float
    granted_error_s: float = 0.0

    @property
    def delay_interval_s(self) -> tuple[float, float]:
        """Interval of the dead time beyond what is granted [s]."""
        half = 0.5 * (self.interval_s[1] - self.interval_s[0]) + self.granted_error_s
        return max(0.0, self.delay_s - half), self.delay_s + half

    @property
    def delay_s(self) -> float:
        """Dead time beyond what is granted [s]."""
        return max(0.0, self.lag_s - self.granted_s)

    @property
    def late(self) -> bool:
        """Whether the lag of the controller clearly exceeds the granted lag."""
        return self.interval_s[0] > self.granted_s + self.least_s and self.after < self.better * self.before


def _shifted(values: FloatArray, shift_s: float, rate_hz: float) -> FloatArray:
    return np.asarray(ndimage.shift(values, shift_s * rate_hz, order=1, mode="nearest"))


def drive_lag(tests: Sequence[LoopSignals], rules: DelayRules | None = None) -> DelayFinding | None:
    """Return the lag of the drive behind desired force and motion; None if the drive does not vary in any test."""
    rules = rules or DelayRules()
    varied = [
        item
        for item in tests
        if _varies(item.drive, [other.drive for other in tests], rules.varies)
        and _varies(item.desired, [other.desired for other in tests], rules.varies)
    ]
    training = [item for item in varied if item.role != "validation"]
    validation = [item for item in varied if item.role == "validation"] or training
    if not training:
        return None
    period = _period(varied)

    def errors(shift: float) -> FloatArray:
        table = _Table(training, shift, rules.acting)
        return np.array([_relative(table.drive(item, shift), item.drive) for item in validation])

    declared = any(item.command_filter_hz > 0.0 for item in varied)
    return _least(errors, "drive-late", _filter_lag(varied, period, rules), period, rules, declared=declared)


def _varies(values: FloatArray, every: Sequence[FloatArray], share: float) -> bool:
    largest = max(float(np.max(np.abs(item), initial=0.0)) for item in every)
    return bool(np.std(values) > share * largest)


def _period(tests: Sequence[LoopSignals]) -> float:
    return float(np.median([item.period_s for item in tests]))


def _filter_lag(tests: Sequence[LoopSignals], period: float, rules: DelayRules) -> float:
    """Return the lag [s] of the filter of the command: as declared, else the granted share of a period."""
    cutoffs = [item.command_filter_hz for item in tests if item.command_filter_hz > 0.0]
    # delay of a second-order Butterworth filter at low frequency
    return float(np.sqrt(2.0) / (2.0 * np.pi * min(cutoffs))) if cutoffs else rules.filter_periods * period


class _Table:
    """Mean drive over bins of the magnitudes of desired force and velocity, at one shift."""

    def __init__(self, tests: Sequence[LoopSignals], shift: float, least: float) -> None:
        pairs = np.concatenate([_sizes(item, shift) for item in tests])
        drive = np.concatenate([item.drive for item in tests])
        acting = pairs[:, 0] > least * float(pairs[:, 0].max())
        # desired forces near zero, where the drive is off, have a separate bin
        self.edges = [
            np.unique(np.quantile(pairs[acting, k], np.linspace(0.0, 1.0, bins)[: -1 if k == 0 else None]))
            for k, bins in enumerate(BINS)
        ]
        place = self._place(pairs)
        size = (len(self.edges[0]) + 1) * (len(self.edges[1]) + 1)
        count = np.bincount(place, minlength=size)
        self.mean = np.bincount(place, weights=drive, minlength=size) / np.maximum(count, 1)

    def _place(self, pairs: FloatArray) -> IntArray:
        first, second = (np.searchsorted(edge, pairs[:, k], side="right") for k, edge in enumerate(self.edges))
        return np.asarray(first * (len(self.edges[1]) + 1) + second, dtype=np.int64)

    def drive(self, item: LoopSignals, shift: float) -> FloatArray:
        """Return the drive that the table predicts, shape (m,)."""
        return np.asarray(self.mean[self._place(_sizes(item, shift))])


def _sizes(item: LoopSignals, shift: float) -> FloatArray:
    pair = (item.desired, item.velocity)
    return np.abs(np.column_stack([_shifted(values, shift, item.rate_hz) for values in pair]))


def law_lag(
    tests: Sequence[LoopSignals], laws: Mapping[str, str], rules: DelayRules | None = None
) -> DelayFinding | None:
    """Return the lag of the desired force behind the motion; None if no test has a linear law.

    Parameters
    ----------
    tests
        Closed-loop recordings.
    laws
        Test -> law; those of vd, vdps and vdns are linear in velocity and displacement where they are not clipped.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or DelayRules()
    linear = [item for item in tests if is_linear(laws.get(item.name, "")) and np.std(item.desired) > 0.0]
    validation = [item for item in linear if item.role == "validation"] or linear
    if not linear:
        return None

    def errors(shift: float) -> FloatArray:
        found = []
        for item in validation:
            acting = np.abs(item.desired) > rules.acting * np.max(np.abs(item.desired))
            rows = np.column_stack([_shifted(v, shift, item.rate_hz) for v in (item.velocity, item.displacement)])
            if item.gains is not None:
                # in harmonic motion a delay is equivalent to a stiffness, so the gains must not be fitted
                rows = (rows @ np.array(item.gains))[:, None]
            numbers = np.linalg.lstsq(rows[acting], item.desired[acting], rcond=None)[0]
            found.append(_relative(rows[acting] @ numbers, item.desired[acting]))
        return np.array(found)

    period = _period(linear)
    declared = any(item.controller_rate_hz > 0.0 for item in linear)
    return _least(errors, "law-late", _held(linear, period, rules), period, rules, declared=declared)


def _held(tests: Sequence[LoopSignals], period: float, rules: DelayRules) -> float:
    """Return the lag of sampling and holding [s]: half a sampling interval if declared, else the granted share."""
    rates = [item.controller_rate_hz for item in tests if item.controller_rate_hz > 0.0]
    return 0.5 / min(rates) if rates else rules.filter_periods * period


def _relative(predicted: FloatArray, measured: FloatArray) -> float:
    return float(np.sqrt(np.mean((predicted - measured) ** 2) / max(float(np.var(measured)), 1e-300)))


def _vertex(shifts: FloatArray, errors: FloatArray, step: float) -> float:
    """Return the shift of least error, from a parabola through the squared errors around the smallest one.

    The squared error of a shifted signal is a parabola near its minimum, so the lag is more accurate than one step.
    """
    place = int(np.argmin(errors))
    near = np.abs(shifts - shifts[place]) < (COARSE - 0.5) * step
    if np.count_nonzero(near) < FITTED or place == 0:
        return float(shifts[place])
    offset = (shifts[near] - shifts[place]) / step
    curvature, slope, _ = np.polyfit(offset, errors[near] ** 2, 2)
    if curvature <= 0.0:
        return float(shifts[place])
    return float(shifts[place] + step * np.clip(-0.5 * slope / curvature, -1.0, 1.0))


def _least(
    errors: Callable[[float], FloatArray],
    part: str,
    granted: float,
    period: float,
    rules: DelayRules,
    *,
    declared: bool,
) -> DelayFinding:
    """Return the shift of least error: first over every fourth step, then over every step around the best one."""
    step = STEP_PERIODS * period
    coarse = COARSE * step * np.arange(int(rules.longest_periods / (COARSE * STEP_PERIODS)) + 1)
    table = {float(shift): errors(float(shift)) for shift in coarse}
    centre = min(table, key=lambda shift: float(np.mean(table[shift])))
    for shift in centre + step * np.arange(1 - COARSE, COARSE):
        if shift >= 0.0 and not any(np.isclose(shift, key, atol=1e-3 * step) for key in table):
            table[float(shift)] = errors(float(shift))
    shifts = np.array(sorted(table))
    values = np.stack([table[shift] for shift in shifts])
    own = np.array([_vertex(shifts, column, step) for column in values.T])
    lag = _vertex(shifts, np.sqrt(np.mean(values**2, axis=1)), step)
    before = float(values[shifts <= granted].mean(axis=1).min())
    spread = float(np.std(own)) / np.sqrt(len(own)) if len(own) > 1 else step
    half = max(2.0 * spread, step)
    return DelayFinding(
        part,
        lag,
        granted,
        before,
        float(values.mean(axis=1).min()),
        (float(lag - half), float(lag + half)),
        rules.least_periods * period,
        rules.better,
        0.0 if declared else granted,
    )
