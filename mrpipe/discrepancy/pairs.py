"""Play beside a rounded yield: two causes that hide each other when they are looked for one after the other.

Both make the force come late at a reversal. A rounded yield fitted without the play takes so wrong a shape that no
small play betters it, and a play without the rounded yield does not pay; together they do. So where the base form
itself is in question, the two are also tried as a pair.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from mrpipe.discrepancy.engine import Fit, fit, start_of
from mrpipe.discrepancy.problem import Problem, Term
from mrpipe.discrepancy.select import Candidate, Selection, draft, share_of
from mrpipe.effects.contract import Effect
from mrpipe.effects.yielding_parts import OWN_DASHPOT

GAPS = (0.01, 0.03, 0.08)
"""Starts of the gap, in strokes."""

LEAST_GAIN = 0.15
"""The pair must leave less than all that was chosen one by one, by this share."""


def with_play(selection: Selection, effects: Mapping[str, Effect]) -> Selection:
    """Return the selection, or that of rounded yield and play together where the pair leaves clearly less.

    Parameters
    ----------
    selection
        What forward selection found, weights by force RMS.
    effects
        The effects considered, with the yielding parts among the forms of `rate-dependent-yield`.
    """
    rate, play = effects.get("rate-dependent-yield"), effects.get("backlash")
    present = {term.effect.name for term in selection.chosen.problem.terms}
    of_base = {term.effect.name for term in selection.base.problem.terms}
    if rate is None or play is None or play.name in present or rate.name in of_base:
        return selection
    small = draft(selection.base)
    trials = [
        _trial(small, (Term(rate, OWN_DASHPOT), Term(play, form)), gap)
        for form in play.forms
        if form.name in ("held", "free")
        for gap in GAPS
    ]
    best = min(trials, key=lambda item: item.cost)
    pair = fit(replace(selection.base.problem, terms=best.problem.terms), best.theta, iterations=10)
    alone = fit(replace(pair.problem, terms=pair.problem.terms[:-1]), pair.theta[:-1], iterations=8)
    least = min(selection.chosen.chi_square, alone.chi_square)
    if pair.chi_square > (1.0 - LEAST_GAIN) * least or "gap" in pair.at_bound:
        return selection
    share = share_of(selection.base, pair, selection.noise)
    form = pair.problem.terms[-1].form.name
    rivals = selection.rounds[1] if len(selection.rounds) > 1 else ()
    second = (Candidate(play.name, pair, share, {form: share}), *(c for c in rivals if c.name != play.name))
    return replace(selection, rounds=(*selection.rounds[:1], second), chosen=pair, proven=2)


def _trial(small: Fit, terms: tuple[Term, ...], gap: float) -> Fit:
    problem: Problem = replace(small.problem, terms=(*small.problem.terms, *terms))
    width = {"gap": gap * problem.scales.stroke}
    declared = small.term_values
    start = start_of(problem, {}, [*declared, {}, width])
    return fit(problem, start, iterations=8)
