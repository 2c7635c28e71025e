"""Backlash (play) together with a rounded yield, which hide each other if they are searched one after the other.

Both delay the force at a reversal. If a rounded yield is fitted without play, its shape becomes so wrong that a small
play does not improve the fit. Therefore play is also tried together with the starting points of the base form.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace

from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.fitting.start import best_starts, shared_values

GAPS = (0.01, 0.03, 0.08)
"""Numerical technique: starting values of the gap, as shares of the stroke."""

FORM_STARTS = 3
"""Numerical technique: number of starting points of the base form, in addition to its fitted one."""

FOLLOWED = 3
"""Numerical technique: number of trials that are fitted further."""


def with_play(found: Fit, effects: Mapping[str, Effect]) -> list[Fit]:
    """Return fits of the base form of `found` with its effects and with play, from several starting points.

    Parameters
    ----------
    found
        Best model on a share of the tests (the draft).
    effects
        Effects that are considered; without `backlash` the result is empty.
    """
    play = effects.get("backlash")
    problem = found.problem
    if play is None or any(term.effect.name == play.name for term in problem.terms):
        return []
    bare = replace(problem, terms=())
    shared = shared_values(found)
    points = [bare.values(point)[0] | shared for point in best_starts(bare, FORM_STARTS)]
    forms = [form for form in play.forms if form.name in ("held", "free")]
    trials = []
    for form, share, values in itertools.product(forms, GAPS, [found.base_values, *points]):
        paired = replace(problem, terms=(*problem.terms, Term(play, form)))
        start = start_of(paired, values, [*found.term_values, {"gap": share * problem.scales.stroke}])
        trials.append(fit(paired, start, iterations=3, tolerance=5e-3))
    trials.sort(key=lambda item: item.cost)
    fits = [fit(item.problem, item.theta, iterations=10) for item in trials[:FOLLOWED]]
    return [item for item in fits if "gap" not in item.at_bound]
