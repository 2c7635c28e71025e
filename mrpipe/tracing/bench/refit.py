"""Joint fits of a model and one further effect, from several starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mrpipe.fitting.engine import Fit, fit, solve, start_of
from mrpipe.fitting.start import shared_values
from mrpipe.fitting.weighting import weighting
from mrpipe.tracing.bench.screen import Screened

DISTANT_STEPS = 6
"""Numerical technique: number of iterations of a refit from a distant start, before it is judged."""

PROMPT = 1000.0
"""Numerical technique: rate of the lag of the drive [1/s] from which a fit with an effect on the time base begins."""


def refit(before: Fit, screened: Screened, *, iterations: int = 7) -> Fit:
    """Fit the terms of `before` and a screened one jointly, from the best of several starts.

    The further starts are the distant ones of its strengths, and a drive without lag if the effect acts on the time
    base: the lag of a model without the effect imitates a part of it.
    """
    problem = replace(before.problem, terms=(*before.problem.terms, screened.term))

    def begun(values: Mapping[str, float], most: int, base: Mapping[str, float] | None = None) -> Fit:
        start = start_of(problem, base or before.base_values, [*before.term_values, values])
        if base is None:
            start[: len(before.theta)] = before.theta
        return fit(problem, start, iterations=most, tolerance=2e-3)

    fits = [begun(screened.values, iterations)]
    fits += [
        begun({**screened.values, item.name: value}, max(iterations, DISTANT_STEPS))
        for item in screened.term.form.searched
        if item.role == "strength"
        for value in item.start_values(problem.scales)[1:]
    ]
    lag = shared_values(before)
    if lag and screened.term.effect.acts_on == "time base":
        prompt = {**before.base_values, **dict.fromkeys(lag, PROMPT)}
        fits.append(begun(screened.values, max(iterations, DISTANT_STEPS), prompt))
    return min(fits, key=lambda item: item.chi_square)


def on_all(before: Fit, drafted: Fit, *, iterations: int) -> Fit:
    """Fit the terms of a draft on all tests of `before`, starting from the values of the draft.

    Parameters that both have start from the draft or from `before`, whichever gives the smaller error, because a fit to
    a share of the tests may have ended far from the optimum of all tests.
    """
    problem = replace(before.problem, terms=(*before.problem.terms, drafted.problem.terms[-1]))
    both = [drafted.theta, np.concatenate([before.theta, drafted.theta[len(before.theta) :]])]
    w = weighting(problem)
    start = min(both, key=lambda theta: solve(problem, theta, w).cost)
    return fit(problem, start, iterations=iterations)
