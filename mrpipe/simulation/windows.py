"""Values of a steady response over successive windows of whole cycles, their mean, and the error of the mean."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.simulation.loop import Response

DISPLAYED = ("rms_x_top_m", "rms_x1_m", "rms_a1_m_s2", "rms_a_top_m_s2", "rms_stroke_m")
"""RMS values that decide whether a response is steady, and that every response curve contains."""

QUANTITIES = (
    *DISPLAYED,
    "rms_drift_m", "rms_base_shear_n", "rms_drive",
    "max_x_top_m", "max_x1_m", "max_a1_m_s2", "max_a_top_m_s2", "max_stroke_m",
    "max_drift_m", "max_base_shear_n", "max_force_n",
)  # fmt: skip
"""The steady quantities of one frequency, in the order of the columns of `ResponseCurve.values`.

`rms_` is the RMS value and `max_` the largest absolute value. The stroke is the displacement across the damper. Of
several dampers, stroke, force and drive are each that of the damper where it is largest. The drift is the difference of
displacement between successive floors, of the storey where it is largest. The base shear is the sum of the floors'
masses times absolute accelerations. The drive is in the unit of the damper, A or V.
"""

SMALLEST_GROUP = 3
"""Least number of windows from whose scatter the effect of sensor noise is estimated."""

FEWEST_BLOCKS = 8
"""Least number of blocks from whose scatter a standard error is computed."""

_IS_RMS = np.array([name.startswith("rms_") for name in QUANTITIES])


def values_between(response: Response, edges_s: FloatArray, absolute: bool) -> FloatArray:
    """Return the QUANTITIES between successive times, shape (len(edges_s) - 1, len(QUANTITIES)).

    The integral of the square is interpolated at the edges, because a period is not a whole number of samples.

    Parameters
    ----------
    response
        Response of the loop.
    edges_s
        Rising times [s], shape (k + 1,).
    absolute
        Whether accelerations are absolute; else relative to the ground.
    """
    t = response.time_s
    edges = np.minimum(edges_s, float(t[-1]))
    start = max(int(np.searchsorted(t, edges[0])) - 1, 0)
    clock = t[start:]
    places = np.searchsorted(clock, edges[:-1])
    half_steps = 0.5 * np.diff(clock)

    def rms(history: FloatArray) -> FloatArray:
        square = history[start:] ** 2
        integral = np.concatenate([[0.0], np.cumsum(half_steps * (square[1:] + square[:-1]))])
        return np.asarray(np.sqrt(np.maximum(np.diff(np.interp(edges, clock, integral)) / np.diff(edges), 0.0)))

    def largest(history: FloatArray) -> FloatArray:
        return np.asarray(np.maximum.reduceat(np.abs(history[start:]), places))

    accelerations = response.absolute_acceleration if absolute else response.acceleration
    x, shear = response.displacement, response.base_shear
    dampers = (response, *response.others)
    strokes, forces, drives = zip(
        *((item.damper_displacement, item.force, item.drive) for item in dampers), strict=True
    )
    floors = response.columns
    first, top = floors[0], floors[-1]
    drifts = [x[:, first], *(x[:, floor] - x[:, below] for below, floor in pairwise(floors))]

    def over(size: Callable[[FloatArray], FloatArray], items: Sequence[FloatArray]) -> FloatArray:
        return np.asarray(np.max([size(item) for item in items], axis=0))

    histories = (x[:, top], x[:, first], accelerations[:, first], accelerations[:, top])
    columns = [*map(rms, histories), over(rms, strokes), over(rms, drifts), rms(shear), over(rms, drives)]
    columns += [*map(largest, histories), over(largest, strokes), over(largest, drifts), largest(shear)]
    columns.append(over(largest, forces))
    return np.column_stack(columns)


def settled(windows: FloatArray, tolerance: float) -> int:
    """Return the number of last windows that are steady; 0 while the values still change.

    The first columns, those of :data:`DISPLAYED`, decide; the others follow them. Two successive windows that agree
    within the tolerance are steady, and the last one counts. Sensor noise makes the windows scatter; then the values
    are steady once the means of the last two groups of windows differ by no more than their scatter explains and the
    mean of both groups is known within the tolerance.

    Parameters
    ----------
    windows
        Values of each window, shape (k, q), k at least 2.
    tolerance
        Relative tolerance.
    """
    judged = windows[:, : len(DISPLAYED)]
    last = judged[-1]
    if np.all(np.abs(last - judged[-2]) <= tolerance * np.abs(last)):
        return 1
    size = len(windows) // 2
    if size < SMALLEST_GROUP:
        return 0
    first, second = judged[-2 * size : -size], judged[-size:]
    mean = 0.5 * (first.mean(axis=0) + second.mean(axis=0))
    scatter = np.sqrt(0.5 * (first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)))
    error = scatter / math.sqrt(2.0 * size)
    drift = np.abs(second.mean(axis=0) - first.mean(axis=0))
    # the standard error of the difference of the two means is twice that of the mean of both
    if np.all(drift <= np.maximum(4.0 * error, tolerance * np.abs(mean))) and np.all(error <= tolerance * np.abs(mean)):
        return 2 * size
    return 0


def mean_values(windows: FloatArray) -> FloatArray:
    """Return the values over all windows together, shape (q,): RMS values of the whole, means of the largest values."""
    return np.asarray(np.where(_IS_RMS, np.sqrt(np.mean(windows**2, axis=0)), np.mean(windows, axis=0)))


def standard_errors(*runs: FloatArray) -> FloatArray:
    """Return the standard error of each of :func:`mean_values` over the windows of all runs, shape (q,).

    Successive windows of an irregular response are correlated. They are therefore joined to longer and longer blocks,
    and the largest of the errors counts that the blocks of each length give (Flyvbjerg and Petersen 1989, J. Chem.
    Phys. 91, 461-466), and that the means of independent runs give.

    Parameters
    ----------
    runs
        Values of each window of a run, shape (k, q); at least two windows together.
    """
    powers = [np.where(_IS_RMS, run**2, run) for run in runs]
    blocks = np.concatenate(powers)
    mean = np.mean(blocks, axis=0)
    found = np.std(blocks, axis=0, ddof=1) / math.sqrt(len(blocks))
    if len(runs) > 1:
        shares = np.array([len(run) / len(blocks) for run in runs])[:, None]
        squares = np.sum((shares * (np.array([power.mean(axis=0) for power in powers]) - mean)) ** 2, axis=0)
        found = np.maximum(found, np.sqrt(len(runs) / (len(runs) - 1.0) * squares))
    while len(blocks) >= 2 * FEWEST_BLOCKS:
        even = len(blocks) // 2 * 2
        blocks = 0.5 * (blocks[0:even:2] + blocks[1:even:2])
        found = np.maximum(found, np.std(blocks, axis=0, ddof=1) / math.sqrt(len(blocks)))
    # the error of a root is that of its square over twice the root
    root = 2.0 * np.sqrt(np.maximum(mean, 0.0))
    return np.asarray(np.where(_IS_RMS, np.divide(found, root, out=np.zeros_like(found), where=root > 0.0), found))
