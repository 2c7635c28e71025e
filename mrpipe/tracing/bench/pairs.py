"""Play beside a rounded yield: two causes that hide each other when they are looked for one after the other.

Both make the force come late at a reversal. A rounded yield fitted without the play takes so wrong a shape that no
small play betters it, and a play without the rounded yield does not pay; together they do. So where the base form
itself is in question, the two are also tried as a pair.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from mrpipe.effects.contract import Effect
from mrpipe.effects.yielding_parts import OWN_DASHPOT
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Problem, Term
from mrpipe.tracing.bench.select import Candidate, Selection, draft, share_of

GAPS = (0.01, 0.03, 0.08)
"""Starts of the gap, in strokes."""

ROUNDED_STARTS = ((0.0, 40.0), (0.0, 200.0), (0.003, 40.0), (0.003, 200.0))
"""Starts of a rounded yield: yield displacement of the hysteresis beside it (0: as it is) and spring rate, in strokes.

Which of the two parts, hysteresis or dashpot, takes the elastic path of a reversal makes two optima far apart.
"""

PLAY_STARTS = ((0.003, 40.0), (0.04, 60.0), (0.003, 400.0))
"""The same beside a play, which may itself be what looked soft."""

DASHPOT_SPEED = 0.12
"""Start of the dashpot's speed, in largest speeds."""

LEAST_ROUNDED = 0.2
"""Share that a rounded yield alone must recover: where the base form is not in question no pair is tried."""

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
    of_base = {term.effect.name for term in selection.base.problem.terms}
    if rate is None or play is None or {rate.name, play.name} & of_base or not selection.rounds:
        return selection
    if all(item.share < LEAST_ROUNDED for item in selection.rounds[0] if item.name == rate.name):
        return selection
    small = draft(selection.base)
    near = min(rounded_drafts(small, rate), key=lambda item: item.cost)
    trials = [
        _trial(small, (Term(rate, OWN_DASHPOT), Term(play, form)), gap * small.problem.scales.stroke, start)
        for form in play.forms
        if form.name in ("held", "free")
        for gap in GAPS
        for start in (near, *(_rounded_start(small, rate, *start) for start in PLAY_STARTS))
    ]
    trials.sort(key=lambda item: item.cost)
    drafts = [fit(item.problem, item.theta, iterations=10) for item in trials[:4]]
    best = min(drafts, key=lambda item: item.cost)
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


def rounded_drafts(small: Fit, rate: Effect) -> list[Fit]:
    """Return fits of a base with a yielding part of its own, from several starts.

    Parameters
    ----------
    small
        Base form on a share of its tests.
    rate
        The effect `rate-dependent-yield`.
    """
    starts = [_rounded_start(small, rate, *start) for start in ROUNDED_STARTS]
    return [fit(item.problem, item.theta, iterations=8) for item in starts]


def _rounded_start(small: Fit, rate: Effect, yield_share: float, spring: float) -> Fit:
    """Return the base with the yielding part at a start; of the fit only problem and values count."""
    scales = small.problem.scales
    values = dict(small.base_values)
    if yield_share:
        values |= {"yield_displacement": yield_share * scales.stroke, "gamma_share": 1.0}
    own = {"spring_rate": spring / scales.stroke, "velocity_scale": DASHPOT_SPEED * scales.speed}
    problem = replace(small.problem, terms=(*small.problem.terms, Term(rate, OWN_DASHPOT)))
    return replace(small, problem=problem, theta=start_of(problem, values, [*small.term_values, own]))


def _trial(small: Fit, terms: tuple[Term, ...], gap: float, start: Fit) -> Fit:
    problem: Problem = replace(small.problem, terms=(*small.problem.terms, *terms))
    width = problem.encode([*start.problem.decode(start.theta), gap])
    return fit(problem, width, iterations=4, tolerance=5e-3)
