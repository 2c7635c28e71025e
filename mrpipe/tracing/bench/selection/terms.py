"""The same model with fewer terms, or with its terms in another order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mrpipe.fitting.engine import Fit, fit, start_of

ITERATIONS = 15
"""Numerical technique: largest number of steps of the fit with the terms that remain."""


def other_places(found: Fit, place: int) -> list[int]:
    """Return the indices of all terms of a fit except one."""
    return [k for k in range(len(found.problem.terms)) if k != place]


def with_terms_in_order(found: Fit, places: Sequence[int], iterations: int = ITERATIONS) -> Fit:
    """Return a fit with some of the terms of another fit, which gives the starts.

    Parameters
    ----------
    found
        The other fit.
    places
        Indices of its terms, in the order that they shall have.
    iterations
        Largest number of steps.
    """
    problem = replace(found.problem, terms=tuple(found.problem.terms[k] for k in places))
    values = [found.term_values[k] for k in places]
    return fit(problem, start_of(problem, found.base_values, values), iterations=iterations)
