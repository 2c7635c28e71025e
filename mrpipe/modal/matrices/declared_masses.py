"""Comparison of the declared floor masses with those that the data give.

For the right masses the modes are orthogonal. Where all floors have a sensor, orthogonality therefore gives the ratios
of the masses, and the response to a measured force gives their common size. A wrong mass and a wrong gain g of the
sensor of a floor have the same effect on orthogonality: the mass appears as m / g^2. Ground excitation separates them,
because the contributions of all modes to the absolute acceleration of a floor sum to one, and to g with a wrong gain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.matrices.masses import NORMAL_95, FloorMasses
from mrpipe.modal.matrices.scaling import Scale, masses_of
from mrpipe.modal.search.selection import Layout, all_floors_measured
from mrpipe.words import in_percent

_LEVEL = 0.01
"""Probability of a finding on masses that are right, over all floors of a structure."""
_GAIN_ERROR = 0.01
"""Standard error of the gain of a calibrated accelerometer. A mass appears with twice this relative error."""


@dataclass(frozen=True)
class MassCheck:
    """Comparison of declared masses with those of the data.

    Attributes
    ----------
    findings
        One line for each floor, or one for all floors, whose declared mass the data contradict.
    intervals
        Shape (n, 2) [kg]: contains the declared mass and the one of the data; of zero width where they agree.
    """

    findings: tuple[str, ...]
    intervals: FloatArray


@dataclass(frozen=True)
class _Ratios:
    """Masses of the data over declared ones, and half widths of the test and of the 95 % interval (logarithms)."""

    values: FloatArray
    limit: FloatArray
    spread: FloatArray


def check_declared_masses(fit: MultiModeFit, layout: Layout, scale: Scale, *, with_scale: bool = True) -> MassCheck:
    """Compare the declared masses with those for which the measured modes are orthogonal.

    Parameters
    ----------
    fit
        The modes.
    layout
        Its masses are compared; without masses, or without a sensor on each floor, nothing is found.
    scale
        Scale of the modes from a measured force or from added masses.
    with_scale
        Whether the scale may be used; not where the place of the force is in doubt.
    """
    declared = layout.masses
    if declared is None or declared.size < 2 or not all_floors_measured(fit, layout):
        return MassCheck((), np.zeros((0, 2)))
    intervals = np.column_stack([declared, declared])
    ratios = _relative(fit, layout, declared)
    wrong = [] if ratios is None else np.flatnonzero(np.abs(np.log(ratios.values)) > ratios.limit).tolist()
    findings = []
    if ratios is not None:
        for row in wrong:
            _widen(intervals, row, declared[row], ratios)
            findings.append(_floor_text(row, ratios, _gain(fit, layout, row)))
    # a wrong gain at the driven floor changes the scale as well
    if with_scale and scale.residues is not None and scale.floor - 1 not in wrong:
        common = _common(fit, layout, declared, scale, wrong)
        if common is not None:
            for row in range(declared.size):
                _widen(intervals, row, declared[row], common)
            findings.append(_common_text(common, scale))
    return MassCheck(tuple(findings), intervals)


def _of(found: FloorMasses, declared: FloatArray, floors: int) -> _Ratios:
    values = found.masses / declared
    error = np.hypot((found.intervals[:, 1] - found.masses) / found.masses / NORMAL_95, 2.0 * _GAIN_ERROR)
    tail = 1.0 - 0.5 * _LEVEL / floors
    quantile = stats.norm.ppf(tail) if found.misfit <= 1.0 else stats.t.ppf(tail, max(found.freedom, 1))
    return _Ratios(values, float(quantile) * error, NORMAL_95 * error)


def _relative(fit: MultiModeFit, layout: Layout, declared: FloatArray) -> _Ratios | None:
    """Return the ratios relative to the floor whose ratio is in the middle; None where the data do not give them."""

    def relative_to(reference: int) -> FloorMasses | None:
        known = np.full(declared.size, np.nan)
        known[reference] = declared[reference]
        found = masses_of(fit, layout, known, Scale())
        return found if found is not None and found.freedom >= 1 else None

    first = relative_to(0)
    if first is None:
        return None
    # of an even number of floors the lower one of the two in the middle
    values = first.masses / declared
    found = relative_to(int(np.argsort(values)[(values.size - 1) // 2]))
    return None if found is None else _of(found, declared, declared.size)


def _common(fit: MultiModeFit, layout: Layout, declared: FloatArray, scale: Scale, wrong: list[int]) -> _Ratios | None:
    """Return a factor that all masses have in common, as ratios of equal value; None where it is one or unknown."""
    found = masses_of(fit, layout, np.full(declared.size, np.nan), scale)
    if found is None or found.freedom < 1:
        return None
    each = _of(found, declared, 1)
    right = [row for row in range(declared.size) if row not in wrong]
    value = float(np.exp(np.median(np.log(each.values[right]))))
    # the errors of the floors are those of the common scale
    limit, spread = float(np.median(each.limit[right])), float(np.median(each.spread[right]))
    if abs(np.log(value)) <= limit:
        return None
    ones = np.ones(declared.size)
    return _Ratios(value * ones, limit * ones, spread * ones)


def _widen(intervals: FloatArray, row: int, declared: float, ratios: _Ratios) -> None:
    low, high = ratios.values[row] * np.exp(np.array([-1.0, 1.0]) * ratios.spread[row])
    intervals[row] = min(intervals[row, 0], declared * low), max(intervals[row, 1], declared * high)


def _gain(fit: MultiModeFit, layout: Layout, row: int) -> float:
    """Return the gain of the sensor of a floor (from 0) over that of the ground; nan where the data do not give it."""
    complete = fit.angular_frequencies.size == layout.floors
    if not complete or len(fit.inputs) != 1 or fit.inputs[0].floor != 0:
        return np.nan
    rows = [i for i, sensor in enumerate(fit.sensors) if sensor.floor == row + 1 and not sensor.is_displacement]
    return float(fit.residues[rows[0]].real.sum()) if rows else np.nan


def _floor_text(row: int, ratios: _Ratios, gain: float) -> str:
    value, spread = float(ratios.values[row]), float(ratios.spread[row])
    percent = f"{in_percent(value, 1)} (+-{in_percent(spread * value, 1)})"
    seen = f"floor {row + 1}: the orthogonality of the modes gives {percent}"
    apparent = float(1.0 / np.sqrt(value))
    mass = f"the declared mass is {1.0 / value:.3g} times the true one"
    reads = f"its sensor reads {in_percent(apparent)} of the motion"
    limit = float(ratios.limit[row])
    if np.isfinite(gain) and gain > 0.0:
        # the gain counts twice in the ratio
        if abs(2.0 * np.log(gain)) <= limit:
            return f"{seen} of its declared mass, and its sensor reads as the others: {mass}"
        if abs(2.0 * np.log(gain / apparent)) <= limit:
            return f"{seen} of its declared mass because {reads}: correct the scale of this channel"
    return f"{seen} of its declared mass: {mass}, or {reads}"


def _common_text(common: _Ratios, scale: Scale) -> str:
    value, spread = float(common.values[0]), float(common.spread[0])
    what = "the force or its unit" if scale.source == "the measured force" else "the added masses"
    return (
        f"floor masses: {scale.source} gives {in_percent(value, 1)} (+-{in_percent(spread * value, 1)}) of the "
        f"declared masses of all floors: the declared masses, {what}, or the unit of the sensors has a wrong factor"
    )
