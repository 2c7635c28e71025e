"""How far the displacement is filtered: the limit of the cut-offs with which base forms leave least.

A spectrum shows where a displacement sinks into its white noise. It cannot separate motion from hum of the mains, and
it does not show what the remaining noise does to a force that follows velocity or acceleration. Therefore the limit is
chosen by the error of models. Before a model is chosen, simple base forms judge the filter. They can prefer a limit
that hides what they lack, so the chosen model judges it again.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from mrpipe.dampers.library import base_form
from mrpipe.fitting.engine import Fit, fit
from mrpipe.fitting.known import Known
from mrpipe.fitting.recordings import Recordings, record_tests
from mrpipe.fitting.start import base_of, best_fit, distinct_levels, first_problem, polynomial_laws
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.select import draft_tests
from mrpipe.tracing.rules import NuisanceRules

FORMS = ("bouc-wen", "bingham", "hyperbolic-tangent", "hysteretic-sigmoid")
"""Numerical technique: base forms that judge the filter: one each that reads displacement, velocity, both, and
acceleration."""

RATIO = 2.0
"""Numerical technique: ratio of successive limits that simple base forms judge."""

FINE_RATIO = 1.4
"""Numerical technique: ratio of successive limits that the chosen model judges."""

FINE_ITERATIONS = 3
"""Numerical technique: iterations of each fit of the chosen model."""

HARMONICS = 4.0
"""Numerical technique: the lowest limit in multiples of the frequency of the motion."""

ITERATIONS = 6
"""Numerical technique: iterations of each fit."""


def highest_cutoff(
    tests: Sequence[PreparedTest],
    automatic: Recordings,
    *,
    rate_hz: float,
    yield_order: int,
    viscosity_order: int,
    known: Known | None = None,
    rules: NuisanceRules | None = None,
    jobs: int = 1,
) -> float:
    """Return the upper limit of the cut-offs of the displacement [Hz]; infinite where the criterion is the best choice.

    Parameters
    ----------
    tests
        Training tests.
    automatic
        The same tests with cut-offs by criterion.
    rate_hz
        Rate at which models are fitted [Hz].
    yield_order, viscosity_order
        Degrees of the laws of the drive.
    known
        Base forms as they were fitted to the same tests before: where the search of each begins.
    rules
        Decision thresholds; their defaults if None.
    jobs
        Threads; the result does not depend on their number.
    """
    rules = rules or NuisanceRules()
    limits = _limits(automatic, RATIO)
    if not limits:
        return np.inf
    few = [tests[place] for place in draft_tests(automatic)]

    def left(highest: float) -> float:
        recordings = record_tests(few, rate_hz=rate_hz, highest_cutoff_hz=highest)
        return min(_left(recordings, name, yield_order, viscosity_order, known) for name in FORMS)

    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        unlimited, *errors = pool.map(left, [np.inf, *limits])
    best, least = np.inf, (1.0 - rules.filter_gain) * unlimited
    for item, error in zip(limits, errors, strict=True):
        if error < least:
            best, least = item, error
    return best


def better_limit(
    found: Fit,
    tests: Sequence[PreparedTest],
    automatic: Recordings,
    highest: float,
    *,
    rate_hz: float,
    rules: NuisanceRules | None = None,
    jobs: int = 1,
) -> float:
    """Return the limit [Hz] with which a chosen model leaves clearly less than with the present one; else that one.

    Parameters
    ----------
    found
        Chosen model, fitted to the training tests.
    tests, automatic
        Training tests, and the same with cut-offs by criterion.
    highest
        Present limit [Hz].
    rate_hz
        Rate at which models are fitted [Hz].
    rules
        Decision thresholds; their defaults if None.
    jobs
        Threads; the result does not depend on their number.
    """
    rules = rules or NuisanceRules()
    errors = _errors(found, tests, {highest, np.inf, *_limits(automatic, FINE_RATIO)}, rate_hz, jobs)
    best = min(errors, key=lambda limit: (errors[limit], -limit))
    return best if errors[best] < (1.0 - rules.filter_again) * errors[highest] else highest


def loosest_limit(
    found: Fit,
    tests: Sequence[PreparedTest],
    automatic: Recordings,
    highest: float,
    *,
    rate_hz: float,
    rules: NuisanceRules | None = None,
    jobs: int = 1,
) -> float:
    """Return the highest limit [Hz] with which a chosen model leaves no more than with the present one.

    Validation tests may hold faster motion than the training tests. A limit that makes no difference in the training
    tests, because simple base forms chose it, would take a part of that motion away.

    Parameters
    ----------
    found, tests, automatic, highest, rate_hz, rules, jobs
        See :func:`better_limit`.
    """
    if not np.isfinite(highest):
        return highest
    rules = rules or NuisanceRules()
    above = {limit for limit in _limits(automatic, FINE_RATIO) if limit > highest}
    errors = _errors(found, tests, {highest, np.inf, *above}, rate_hz, jobs)
    return max(limit for limit, error in errors.items() if error <= (1.0 + rules.filter_again) * errors[highest])


def _errors(
    found: Fit, tests: Sequence[PreparedTest], limits: Collection[float], rate_hz: float, jobs: int
) -> dict[float, float]:
    """Return limit [Hz] -> RMS of the residual of a chosen model, as a share of the scale of the force."""

    def left(limit: float) -> float:
        recordings = record_tests(tests, rate_hz=rate_hz, highest_cutoff_hz=limit)
        weight = recordings.used / found.problem.scales.force
        problem = replace(found.problem, recordings=recordings, root_weight=weight)
        return float(np.sqrt(fit(problem, found.theta, iterations=FINE_ITERATIONS).chi_square))

    ordered = sorted(limits)
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return dict(zip(ordered, pool.map(left, ordered), strict=True))


def _limits(recordings: Recordings, ratio: float) -> list[float]:
    """Return the limits that are tried [Hz], the highest first."""
    lowest, limit = _lowest(recordings), float(np.max(recordings.cutoff_hz)) / ratio
    limits = []
    while limit > lowest:
        limits.append(limit)
        limit /= ratio
    return limits


def _lowest(recordings: Recordings) -> float:
    """Return the lowest limit that is tried [Hz]: a few times the frequency of the fastest motion."""
    return HARMONICS / float(np.min(recordings.motion_period_s))


def _left(recordings: Recordings, name: str, yield_order: int, viscosity_order: int, known: Known | None) -> float:
    """Return the RMS of the residual of a base form, as a share of the scale of the force."""
    form = base_form(name)
    laws = polynomial_laws(form, distinct_levels(recordings), yield_order, viscosity_order)
    problem = first_problem(recordings, base_of(recordings, form, laws))
    found = best_fit(problem, starts=1, iterations=ITERATIONS, known=known)
    return float(np.sqrt(found.chi_square))
