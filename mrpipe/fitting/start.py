"""From a base form and recordings to a first fit: levels of drive, shapes of the laws, starts of the search."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.forms import DEFAULT_FORM
from mrpipe.dampers.laws import Law, LawShape, constant_law, for_blocks
from mrpipe.dampers.library import base_form
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.known import Known, known_start
from mrpipe.fitting.problem import Base, Problem
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.solution import solve
from mrpipe.fitting.weighting import weighting

VARYING_SHARE = 0.05
"""A drive that changes within a test by this share of the largest drive counts as varying."""

LEVEL_SHARE = 0.02
"""Levels of drive that differ by less than this share of the largest drive count as one."""

MANY_LEVELS = 99
"""Number of levels where the drive varies continuously within tests."""

LEAST_HELD = 0.01
"""Numerical technique: an interval of drive is held if it has at least this share of the samples."""

MOST_HELD = 0.9
"""Numerical technique: a drive of steps has at least this share of its samples in intervals that are held ..."""

WIDEST_LEVEL = 0.1
"""Numerical technique: ... and no interval of its levels is wider than this share of the largest drive."""

MOST_STARTS = 36
"""Largest number of combinations of the starts of parameters; of more combinations, this many are picked evenly."""

MORE_POINTS = 3
"""Number of points that are followed for a few steps, for each fit that is completed."""

BEGUN_STEPS = 3
"""Number of steps after which the best points are chosen."""


def tests_of_varying_drive(recordings: Recordings) -> BoolArray:
    """Return the tests within which the drive changes, shape (tests,)."""
    largest = float(np.max(np.abs(recordings.drive)))
    spans = [float(np.ptp(recordings.drive[a:b])) for a, b in itertools.pairwise(recordings.starts)]
    return np.array(spans) > VARYING_SHARE * largest


def drive_varies(recordings: Recordings) -> bool:
    """Return whether the drive changes within any test."""
    return bool(np.any(tests_of_varying_drive(recordings)))


def mean_levels(recordings: Recordings) -> FloatArray:
    """Return the mean drive of each test [A or V], shape (tests,)."""
    return np.array([float(np.mean(recordings.drive[a:b])) for a, b in itertools.pairwise(recordings.starts)])


def distinct_levels(recordings: Recordings) -> int:
    """Return how many levels of drive the tests hold; :data:`MANY_LEVELS` where it varies continuously within tests."""
    largest = float(np.max(np.abs(recordings.drive)))
    if largest == 0.0:
        return 1
    if drive_varies(recordings):
        return _levels_of_steps(recordings.drive / largest)
    return 1 + int(np.sum(np.diff(np.sort(mean_levels(recordings))) > LEVEL_SHARE * largest))


def _levels_of_steps(drive: FloatArray) -> int:
    """Return the number of levels between which a drive steps; :data:`MANY_LEVELS` if it is not one of steps.

    A drive of steps has nearly all of its samples in a few narrow intervals. A continuous drive fills wide intervals.
    """
    counts, edges = np.histogram(
        drive, bins=np.arange(np.min(drive) - LEVEL_SHARE, 1.0 + 2.0 * LEVEL_SHARE, LEVEL_SHARE)
    )
    held = counts > LEAST_HELD * len(drive)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(np.int64), [0]])))
    widths = edges[ends[1::2]] - edges[ends[::2]]
    if np.sum(counts[held]) < MOST_HELD * len(drive) or np.any(widths > WIDEST_LEVEL):
        return MANY_LEVELS
    return len(widths)


def polynomial_laws(form: BaseForm, levels: int, yield_order: int, viscosity_order: int) -> tuple[LawShape, ...]:
    """Return polynomial laws of these degrees, or of the largest degrees that the levels of drive determine."""
    orders = {"c0": viscosity_order}
    return tuple(LawShape("polynomial", min(orders.get(block, yield_order), levels - 1)) for block in form.blocks)


def base_of(
    recordings: Recordings, form: BaseForm, laws: Sequence[LawShape], held: Mapping[str, float] | None = None
) -> Base:
    """Return the base of a problem: a form with its laws; the scales of the recordings fix its reference values.

    Parameters
    ----------
    recordings
        Concatenated tests.
    form
        Form of the damper.
    laws
        One for each block of the form; the first one serves further blocks.
    held
        Parameters that are not searched.
    """
    shapes = for_blocks(laws, len(form.blocks))
    fixed = {**form.constants(recordings.scales()), **(held or {})}
    return Base(form, shapes, lag_known=drive_varies(recordings), held=fixed)


def first_reference(base: Base, recordings: Recordings) -> tuple[Law, ...]:
    """Return laws of the correct order of magnitude before anything is fitted; they are constant in the drive."""
    scales = recordings.scales()
    viscosity = constant_law(0.1 * scales.force / max(scales.speed, 1e-9))
    return tuple(viscosity if block == "c0" else constant_law(scales.force) for block in base.form.blocks)


def first_problem(recordings: Recordings, base: Base) -> Problem:
    """Return the unweighted problem with no effect.

    The laws that a coupled form reads are those of a fitted simple hysteresis, because its post-yield force is similar,
    or those of the form that it names (`begins_with`), fitted to the same tests.
    """
    scales = recordings.scales()
    weight = recordings.used / scales.force
    problem = Problem(recordings, base, (), weight, scales, first_reference(base, recordings))
    if not base.form.coupled:
        return problem
    other = base_form(base.form.begins_with or DEFAULT_FORM)
    plain = first_problem(recordings, base_of(recordings, other, base.laws[:2]))
    if base.form.begins_with:
        return replace(problem, reference=best_fit(plain, starts=1, iterations=BEGUN_STEPS).laws)
    found = solve(plain, start_of(plain, {}, []), weighting(plain))
    laws = plain.base.laws_of(found.linear, plain.values(start_of(plain, {}, []))[0], scales.drive)
    return replace(problem, reference=laws)


def start_points(problem: Problem) -> list[FloatArray]:
    """Return the combinations of the starts of all searched parameters, at most :data:`MOST_STARTS`."""
    choices = [parameter.start_values(problem.scales) for _, parameter in problem.searched]
    combinations = list(itertools.product(*choices))
    step = -(-len(combinations) // MOST_STARTS)
    low, high = problem.bounds() if choices else (np.zeros(0), np.zeros(0))
    return [np.clip(problem.encode(values), low, high) for values in combinations[::step]]


def best_starts(problem: Problem, count: int) -> list[FloatArray]:
    """Return the `count` starting points with the smallest error, the best first."""
    w = weighting(problem)
    points = start_points(problem)
    costs = [solve(problem, point, w).cost for point in points]
    return [points[place] for place in np.argsort(costs, kind="stable")[:count]]


def shared_values(found: Fit) -> dict[str, float]:
    """Return the parameters of a base form that all base forms share: those of the lag of the drive."""
    return {name: value for name, value in found.base_values.items() if name.startswith("eta")}


def own_start(problem: Problem, found: Fit) -> FloatArray:
    """Return the best start of the base form, together with the terms and the lag of a fit.

    Parameters
    ----------
    problem
        Problem of a base form with the terms of `found`.
    found
        Fit with another base form.
    """
    bare = replace(problem, terms=())
    shared = shared_values(found)
    points = [start_of(problem, bare.values(point)[0] | shared, found.term_values) for point in start_points(bare)]
    # starts that differ only in the lag are the same start here
    points = list({tuple(point): point for point in points}.values())
    w = weighting(problem)
    return min(points, key=lambda point: solve(problem, point, w).cost)


def followed(problem: Problem, points: Sequence[FloatArray], starts: int, iterations: int) -> list[Fit]:
    """Return fits from the points that are best after a few steps, the best fit first.

    The error before the first step is a poor measure if two parts of a form can replace each other.
    """
    if problem.base.form.coupled:
        # a fit of a coupled form takes several times as long as one of another form
        points = points[:starts]
    begun = [fit(problem, point, iterations=BEGUN_STEPS) for point in points]
    begun.sort(key=lambda item: item.cost)
    fits = [fit(item.problem, item.theta, iterations=iterations) for item in begun[:starts]]
    return sorted(fits, key=lambda item: item.cost)


def best_fit(problem: Problem, *, starts: int = 2, iterations: int = 12, known: Known | None = None) -> Fit:
    """Fit from the known fit of the base form, if there is one, else from the best starting points."""
    begun = known_start(problem, known)
    if begun is not None:
        return fit(*begun, iterations=iterations)
    return followed(problem, best_starts(problem, MORE_POINTS * starts), starts, iterations)[0]


def with_form(found: Fit, form: BaseForm) -> Problem:
    """Return the problem of a fit with another base form, and with the same laws and weights."""
    problem = found.problem
    base = problem.base
    held = form.constants(problem.scales)
    laws = tuple(base.laws[min(place, 1)] if place < 2 else base.laws[0] for place in range(len(form.blocks)))
    reference = (*found.laws[:2], *[found.laws[0]] * (len(form.blocks) - 2))
    return replace(problem, base=replace(base, form=form, laws=laws, held=held), reference=reference)


def fit_with_form(
    found: Fit, form: BaseForm, *, starts: int = 2, iterations: int = 12, known: Known | None = None
) -> Fit:
    """Return the fit with another base form; the terms start at their fitted values.

    Parameters
    ----------
    found
        Fit with another form.
    form
        The form.
    starts, iterations
        See :func:`followed`.
    known
        Known fits, from which the search begins; without one it begins at the starts of the form.
    """
    problem = with_form(found, form)
    shared = {name: value for name, value in found.base_values.items() if name in ("eta", "eta_fall")}
    begun = known_start(problem, known, shared, found.term_values)
    if begun is not None:
        return fit(*begun, iterations=iterations)
    bare = replace(problem, terms=())
    points = [
        start_of(problem, {**bare.values(point)[0], **shared}, found.term_values)
        for point in best_starts(bare, MORE_POINTS * starts)
    ]
    return followed(problem, points, starts, iterations)[0]
