"""Which of several effects are needed: not one that another form of the others makes superfluous.

The search adds effects in their plain forms, to a base form with simple laws of the drive. A second effect may then
only correct the form of the first one, or the laws. Before it is named, the richer forms of the other effects and the
richer laws are tried without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.tracing.bench.drive_again import with_adequate_laws
from mrpipe.tracing.bench.race import on_all_tests
from mrpipe.tracing.bench.refine import with_best_forms
from mrpipe.tracing.bench.select import Selection, draft

ITERATIONS = 15
"""Numerical technique: most steps of a fit without one of the effects."""


def without_superfluous(
    selection: Selection, declared: int, *, lead: float, yield_order: int, viscosity_order: int
) -> Selection:
    """Return the selection without effects that richer forms of the others, or richer laws of the drive, replace.

    An effect that is dropped is kept as a further term, whose cause is not proven.

    Parameters
    ----------
    selection
        Named effects with their fit.
    declared
        How many terms the campaign declares: they belong to the baseline and are never dropped.
    yield_order, viscosity_order
        Largest degrees of the laws of the drive.
    lead
        An effect is dropped if the fit without it has at most this multiple of the chi-square of the fit with it.
    """
    without = partial(_without, yield_order=yield_order, viscosity_order=viscosity_order)
    kept = selection
    while kept.proven > 1 and len(kept.chosen.problem.terms) >= declared + 2:
        named = range(declared, min(declared + kept.proven, len(kept.chosen.problem.terms)))
        small = draft(kept.chosen)
        full = with_best_forms(small, named)
        place, best = min(((k, without(small, k, named)) for k in named), key=lambda item: item[1].chi_square)
        if best.chi_square > lead * full.chi_square:
            break
        # a share of the tests has ranked them, all tests decide
        full, best = (on_all_tests(item, kept.chosen.problem) for item in (full, best))
        if best.chi_square > lead * full.chi_square:
            break
        extension = kept.extension
        if kept is selection:
            others = [k for k in range(len(full.problem.terms)) if k != place]
            extension = _in_order(full, [*others, place])
        kept = replace(
            kept,
            chosen=best,
            proven=kept.proven - 1,
            # a round that compares what remains with its rivals, the first one even where its winner was dropped
            rounds=kept.rounds[: place - declared] or kept.rounds[:1],
            extension=extension,
        )
    return kept


def _without(found: Fit, place: int, named: range, *, yield_order: int, viscosity_order: int) -> Fit:
    """Return the fit without one term, with adequate laws of the drive and the best forms of the other named terms."""
    others = [k for k in range(len(found.problem.terms)) if k != place]
    start = with_adequate_laws(_in_order(found, others), yield_order, viscosity_order)
    return with_best_forms(start, range(named.start, named.stop - 1))


def _in_order(found: Fit, places: Sequence[int]) -> Fit:
    """Return a fit with these terms in this order, from the values of another fit."""
    problem = replace(found.problem, terms=tuple(found.problem.terms[k] for k in places))
    values = [found.term_values[k] for k in places]
    return fit(problem, start_of(problem, found.base_values, values), iterations=ITERATIONS)
