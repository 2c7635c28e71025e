"""Gain of an effect on whole training tests left out, with a block bootstrap; intervals of parameters."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from scipy import stats

from mrpipe.artifacts import BoolArray, FloatArray, IntArray
from mrpipe.fitting.engine import Fit, fit, linear_derivatives, predict, searched_derivatives
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.solution import regressors
from mrpipe.fitting.weighting import weighting
from mrpipe.tracing.bench.residuals.residual_structure import BLOCK
from mrpipe.tracing.gain import Gain

BEYOND = 0.01
"""Numerical technique: tolerance at the ends of the range that a fit has seen, as a share of the range."""


def folds_of(recordings: Recordings, folds: int, among: Sequence[int] | None = None) -> list[list[int]]:
    """Return the tests of each fold: every k-th test in the order of drive level, then stroke.

    A campaign usually steps through its drive levels. Folds in the order of the campaign could leave out all tests of
    one level, and the other levels do not determine the force at this level.

    Parameters
    ----------
    recordings
        Tests laid end to end.
    folds
        Number of folds.
    among
        Indices of the tests that are divided; None: all.
    """

    def level_and_stroke(index: int) -> tuple[float, float]:
        part = recordings.test == index
        return round(float(np.mean(np.abs(recordings.drive[part]))), 2), float(np.ptp(recordings.displacement[part]))

    order = sorted(range(recordings.tests) if among is None else among, key=level_and_stroke)
    return [sorted(order[k::folds]) for k in range(folds)]


def left_out_residual(found: Fit, folds: int, *, jobs: int = 1) -> FloatArray:
    """Return the weighted residual of every training test by a fit without this test, shape (n,).

    It is zero where motion or drive exceed the range of the fitted tests. An end stop that only one test reaches, for
    example, cannot be found from the other tests, so their prediction does not refute it.
    """
    problem = found.problem
    recordings = problem.recordings
    parts = folds_of(recordings, folds)

    def one(part: list[int]) -> tuple[list[int], FloatArray, BoolArray]:
        keep = [t for t in range(recordings.tests) if t not in part]
        within = np.isin(recordings.test, keep)
        learned = fit(
            replace(problem, recordings=recordings.subset(keep), root_weight=problem.root_weight[within]),
            found.theta,
            iterations=2,
        )
        left_out = recordings.subset(part)
        return part, predict(learned, left_out), samples_seen_by(recordings.subset(keep), left_out)

    result = np.zeros(len(recordings.force))
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        known = np.ones(len(result), dtype=np.bool_)
        for part, force, seen in pool.map(one, [part for part in parts if part]):
            within = np.isin(recordings.test, part)
            result[within] = recordings.force[within] - force
            known[within] = seen
    weights = np.where(known, problem.root_weight, 0.0)
    return _without_offsets(result, problem.recordings.test, weights)


def samples_seen_by(known: Recordings, other: Recordings) -> BoolArray:
    """Return the samples of `other` whose motion and drive lie in the range of `known`, shape (n of other,) of bool."""
    inside = np.ones(len(other.force), dtype=np.bool_)
    for name in ("displacement", "velocity", "drive"):
        have, ask = getattr(known, name), getattr(other, name)
        margin = BEYOND * float(np.ptp(have))
        inside &= (ask >= np.min(have) - margin) & (ask <= np.max(have) + margin)
    return inside


def _without_offsets(error: FloatArray, test: IntArray, root_weight: FloatArray) -> FloatArray:
    """Return the weighted error without the mean of each test, which is the offset of a sensor."""
    weight = root_weight**2
    sums = np.bincount(test, weights=weight)
    means = np.bincount(test, weights=weight * error) / np.maximum(sums, 1e-300)
    return np.asarray((error - means[test]) * root_weight)


def gain_of(before: FloatArray, after: FloatArray, problem: Problem, *, draws: int, rng: np.random.Generator) -> Gain:
    """Return the share by which the left-out squared error falls from `before` to `after`, with its interval."""
    block = np.unique(problem.recordings.blocks(BLOCK), return_inverse=True)[1]
    first = np.bincount(block, weights=before**2)
    second = np.bincount(block, weights=after**2)
    chosen = rng.integers(len(first), size=(draws, len(first)))
    shares = 1.0 - second[chosen].sum(axis=1) / np.maximum(first[chosen].sum(axis=1), 1e-300)
    low, high = np.quantile(shares, [0.025, 0.975])
    return Gain(float(1.0 - second.sum() / max(first.sum(), 1e-300)), (float(low), float(high)))


def intervals(found: Fit) -> list[dict[str, tuple[float, float]]]:
    """Return 95 % intervals of every parameter of the effects, by a jackknife over whole tests.

    Errors of a model persist within a test, so the samples of one test are not independent. Each test is left out in
    turn, with the Jacobian of the fit to all tests (one Gauss-Newton step). The spread of the resulting values is the
    jackknife estimate: Cameron and Miller 2015, Journal of Human Resources 50, 317-372, CV3.

    Parameters
    ----------
    found
        A fit with effects.

    Returns
    -------
    For each term: parameter -> lower and upper end, in SI.
    """
    problem = found.problem
    w = weighting(problem)
    residual = found.residual[w.at]
    # the derivative of the projected residual gives the searched values; amplitudes are differentiated with them
    columns = regressors(problem, found.theta)
    rows = np.concatenate([searched_derivatives(found), linear_derivatives(found, columns)])
    first = problem.base.columns
    deviation, tests = _jackknife(-rows, residual, problem.recordings.test[w.at])
    factor = float(stats.t.ppf(0.975, max(tests - 1, 1)))
    result: list[dict[str, tuple[float, float]]] = [{} for _ in problem.terms]
    for k, (index, parameter) in enumerate(problem.searched):
        if index >= 0:
            edges = [found.theta[k] - factor * deviation[k], found.theta[k] + factor * deviation[k]]
            unit = problem.scales.of(parameter.scale)
            pair = [float(np.exp(min(e, 60.0))) if parameter.logarithmic else float(e * unit) for e in edges]
            result[index][parameter.name] = (pair[0], pair[1])
    for k, (index, parameter) in enumerate(problem.amplitudes):
        if index < 0:
            continue
        half = factor * deviation[len(problem.searched) + first + k]
        value = float(found.linear[first + k])
        result[index][parameter.name] = (value - half, value + half)
    return result


def _jackknife(rows: FloatArray, residual: FloatArray, test: IntArray) -> tuple[FloatArray, int]:
    """Return the standard error of each coefficient of a regression, shape (p,), and the number of tests.

    Parameters
    ----------
    rows
        Regressors, shape (p, n).
    residual
        Residual of the regression, shape (n,).
    test
        Test of each sample, shape (n,).
    """
    size = np.sqrt(np.maximum(np.sum(rows**2, axis=1), 1e-300))
    scaled = rows / size[:, None]
    gram = scaled @ scaled.T
    present = np.unique(test)
    changes = np.empty((len(present), len(rows)))
    for place, number in enumerate(present):
        own = scaled[:, test == number]
        without = np.linalg.pinv(gram - own @ own.T, rcond=1e-10, hermitian=True)
        changes[place] = -without @ (own @ residual[test == number])
    count = len(present)
    spread = np.sqrt((count - 1) / count * np.sum((changes - changes.mean(axis=0)) ** 2, axis=0))
    return spread / size, count
