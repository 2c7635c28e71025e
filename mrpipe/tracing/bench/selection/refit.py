"""Joint fits of a model and one further effect, from several starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.solution import solve
from mrpipe.fitting.weighting import weighting
from mrpipe.tracing.bench.selection.screen import Screened

DISTANT_STEPS = 6
"""Numerical technique: number of iterations of a refit from a distant start, before it is judged."""


def refit(before: Fit, screened: Screened, *, iterations: int = 7) -> Fit:
    """Fit the terms of `before` and a screened one jointly, from the best of the starts of its strengths."""
    problem = replace(before.problem, terms=(*before.problem.terms, screened.term))

    def begun(values: Mapping[str, float], most: int) -> Fit:
        start = start_of(problem, before.base_values, [*before.term_values, values])
        start[: len(before.theta)] = before.theta
        return fit(problem, start, iterations=most, tolerance=2e-3)

    near = begun(screened.values, iterations)
    distant = [
        begun({**screened.values, item.name: value}, max(iterations, DISTANT_STEPS))
        for item in screened.term.form.searched
        if item.role == "strength"
        for value in item.start_values(problem.scales)[1:]
    ]
    return min([near, *distant], key=lambda item: item.chi_square)


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
