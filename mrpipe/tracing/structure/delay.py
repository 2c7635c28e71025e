"""Is the controller late: drive against desired force, desired force against its law, on shifts of the clock.

A controller samples, filters and holds: a lag of that much belongs to it. The drive is compared with a table over the
sizes of desired force and velocity at an earlier time, learnt on training tests; the desired force with its own law
(proportional to velocity and displacement, where it is not clipped). The shift of least error is the lag.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control.laws import is_linear

FILTER_S = 0.004
"""Lag that a low-pass on the command is granted: a second-order one at 60 Hz (thesis section 5.2)."""

LEAST_S = 0.003
"""A dead time below this is within what holding and filters of unknown make may take."""

STEP_S = 0.001
BINS = (16, 10)


@dataclass(frozen=True)
class LoopSignals:
    """A closed-loop test on its own clock; SI, shape (m,) each.

    `displacement`, `velocity` are those of the damper, relative to the ground; `gains` are the law's on velocity
    [N s/m] and displacement [N/m], None where they were not told.
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


@dataclass(frozen=True)
class DelayFinding:
    """What was found of one part of the controller.

    Attributes
    ----------
    part
        `drive-late` or `law-late`.
    lag_s, granted_s
        Shift of least error; what sampling and filters are granted of it.
    before, after
        Error on validation tests over the RMS of the signal, without and with the dead time beyond what is granted.
    interval_s
        Interval of the delay [s].
    """

    part: str
    lag_s: float
    granted_s: float
    before: float
    after: float
    interval_s: tuple[float, float]

    @property
    def delay_s(self) -> float:
        """Dead time beyond what is granted [s]."""
        return max(0.0, self.lag_s - self.granted_s)

    @property
    def late(self) -> bool:
        """Whether the controller is late at all."""
        return self.interval_s[0] > self.granted_s + LEAST_S and self.after < 0.8 * self.before


def _shifted(values: FloatArray, shift_s: float, rate_hz: float) -> FloatArray:
    return np.asarray(ndimage.shift(values, shift_s * rate_hz, order=1, mode="nearest"))


def drive_lag(tests: Sequence[LoopSignals], *, longest_s: float = 0.08) -> DelayFinding | None:
    """Return how late the drive is for desired force and motion, None where no test varies its drive."""
    varied = [item for item in tests if np.std(item.drive) > 1e-3 and np.std(item.desired) > 1e-6]
    training = [item for item in varied if item.role != "validation"]
    validation = [item for item in varied if item.role == "validation"] or training
    if not training:
        return None
    granted = FILTER_S

    def errors(shift: float) -> FloatArray:
        table = _Table(training, shift)
        return np.array([_relative(table.drive(item, shift), item.drive) for item in validation])

    return _least(errors, "drive-late", granted, longest_s)


class _Table:
    """Mean drive over bins of the sizes of desired force and velocity, at one shift."""

    def __init__(self, tests: Sequence[LoopSignals], shift: float) -> None:
        pairs = np.concatenate([_sizes(item, shift) for item in tests])
        drive = np.concatenate([item.drive for item in tests])
        acting = pairs[:, 0] > 0.02 * float(pairs[:, 0].max())
        # what is not asked for is a bin of its own
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
        """Return the drive that the table tells, shape (m,)."""
        return np.asarray(self.mean[self._place(_sizes(item, shift))])


def _sizes(item: LoopSignals, shift: float) -> FloatArray:
    pair = (item.desired, item.velocity)
    return np.abs(np.column_stack([_shifted(values, shift, item.rate_hz) for values in pair]))


def law_lag(tests: Sequence[LoopSignals], laws: Mapping[str, str], *, longest_s: float = 0.08) -> DelayFinding | None:
    """Return how late the desired force is for the motion, None where no test follows a linear law.

    Parameters
    ----------
    laws
        Test -> law; those of vd, vdps and vdns are linear in velocity and displacement where they are not clipped.
    tests
        Closed-loop recordings.
    longest_s
        Longest delay that is searched [s].
    """
    linear = [item for item in tests if is_linear(laws.get(item.name, "")) and np.std(item.desired) > 0.0]
    validation = [item for item in linear if item.role == "validation"] or linear
    if not linear:
        return None

    def errors(shift: float) -> FloatArray:
        found = []
        for item in validation:
            acting = np.abs(item.desired) > 0.02 * np.max(np.abs(item.desired))
            rows = np.column_stack([_shifted(v, shift, item.rate_hz) for v in (item.velocity, item.displacement)])
            if item.gains is not None:
                # in harmonic motion gains left free would turn a delay into stiffness
                rows = (rows @ np.array(item.gains))[:, None]
            numbers = np.linalg.lstsq(rows[acting], item.desired[acting], rcond=None)[0]
            found.append(_relative(rows[acting] @ numbers, item.desired[acting]))
        return np.array(found)

    return _least(errors, "law-late", _held(linear), longest_s)


def _held(tests: Sequence[LoopSignals]) -> float:
    """Return half a sample of the controller: what sampling and holding make of it."""
    rates = [item.controller_rate_hz for item in tests if item.controller_rate_hz > 0.0]
    return 0.5 / min(rates) if rates else 0.0025


def _relative(predicted: FloatArray, measured: FloatArray) -> float:
    return float(np.sqrt(np.mean((predicted - measured) ** 2) / max(float(np.var(measured)), 1e-300)))


def _least(errors: Callable[[float], FloatArray], part: str, granted: float, longest_s: float) -> DelayFinding:
    coarse = np.arange(0.0, longest_s + 1e-9, 4.0 * STEP_S)
    table = {float(shift): errors(float(shift)) for shift in coarse}
    centre = min(table, key=lambda shift: float(np.mean(table[shift])))
    for shift in centre + STEP_S * np.arange(-3, 4):
        if shift >= 0.0 and round(float(shift), 6) not in [round(key, 6) for key in table]:
            table[float(shift)] = errors(float(shift))
    shifts = np.array(sorted(table))
    values = np.stack([table[shift] for shift in shifts])
    own = shifts[np.argmin(values, axis=0)]
    lag = float(shifts[int(np.argmin(values.mean(axis=1)))])
    before = float(values[shifts <= granted + 1e-9].mean(axis=1).min())
    spread = float(np.std(own)) / np.sqrt(len(own)) if len(own) > 1 else STEP_S
    half = max(2.0 * spread, STEP_S)
    return DelayFinding(
        part, lag, granted, before, float(values.mean(axis=1).min()), (float(lag - half), float(lag + half))
    )
