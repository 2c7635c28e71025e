"""Fits to all training tests after a race: of its winner, of its candidates, and of the winner with further terms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mrpipe.fitting.engine import Fit
from mrpipe.fitting.problem import Problem
from mrpipe.tracing.bench.base_forms.fits_of_forms import on_all_tests
from mrpipe.tracing.bench.base_forms.race import Model, Race
from mrpipe.tracing.bench.selection.select import EffectCandidate, Selection, share_of
from mrpipe.tracing.rules import RefinementRules

PROMOTED = 3
"""Numerical technique: candidates of each round that are fitted to all training tests, not only to the draft ..."""

PROMOTED_STEPS = 6
"""Numerical technique: ... and largest number of iterations of these fits."""


def winner_on_all_tests(found: Race, winner: Model, base: Fit) -> Selection:
    """Return the winner of a race, fitted to all training tests, without its candidates.

    Parameters
    ----------
    found
        The race.
    winner
        Model that won the race.
    base
        Fit of the declared form to all training tests.
    """
    ground = None
    if winner.form != found.declared:
        ground = on_all_tests(found.plain(winner.form).fit, base.problem, found.coupled)
    chosen = ground or base
    if len(winner.effects) > len(found.own):
        chosen = on_all_tests(winner.fit, base.problem, found.coupled)
    return Selection(base, found.noise, (), chosen, ground=ground)


def with_candidates(selection: Selection, found: Race) -> Selection:
    """Return a selection with the candidates of each round of the search, fitted to all training tests.

    Parameters
    ----------
    selection
        A model of the race, fitted to all training tests.
    found
        The race.
    """
    count, form = len(found.own), selection.chosen.problem.base.name
    effects = _effects(selection.chosen)
    rounds: list[tuple[EffectCandidate, ...]] = []
    search = found.searches.get(form, found.searches.get(found.declared))
    for place, candidates in enumerate((search.rounds if search else ())[: max(1, len(effects) - count)]):
        if any(_effects(item.fit)[:-1] != effects[: count + place] for item in candidates[:1]):
            break
        rounds.append(_on_all(candidates, found, selection, count + place))
    return replace(selection, rounds=tuple(rounds))


def _effects(found: Fit) -> tuple[str, ...]:
    return tuple(term.effect.name for term in found.problem.terms)


def _on_all(
    candidates: tuple[EffectCandidate, ...], found: Race, selection: Selection, place: int
) -> tuple[EffectCandidate, ...]:
    """Return the candidates of a round fitted to all training tests, the chosen effect first."""
    base, chosen = selection.base, selection.chosen
    effects, result = _effects(chosen), []
    own = effects[place] if place < len(effects) else ""
    for rank, item in enumerate(candidates):
        last = item.name == own and place == len(effects) - 1
        steps = PROMOTED_STEPS if rank < PROMOTED else 0
        fitted = chosen if last else on_all_tests(item.fit, base.problem, found.coupled, iterations=steps)
        result.append(replace(item, fit=fitted, share=share_of(base, fitted, selection.noise)))
    return tuple(sorted(result, key=lambda item: (item.name != own, item.fit.chi_square)))


def extension_of(
    found: Race,
    winner: Model,
    chosen: Fit,
    problem: Problem,
    search: Callable[[Fit], Selection],
    rules: RefinementRules,
) -> Fit | None:
    """Return the winner with further terms, fitted to all training tests; None if there are none.

    Further terms improve the model although their cause is not proven.

    Parameters
    ----------
    found, winner
        The race and the model that won it.
    chosen
        The winner, fitted to all training tests.
    problem
        Problem of the declared form on all training tests.
    search
        Function that searches effects from a fit.
    rules
        Decision thresholds.
    """
    if chosen.chi_square < (1.0 + rules.worth_a_try) * found.noise:
        return None
    model = found.extended(winner)
    further = model.fit
    if model is winner and winner.form not in found.searches:
        further = search(winner.fit).chosen
    if len(further.problem.terms) == len(winner.effects):
        return None
    return on_all_tests(further, problem, found.coupled)
