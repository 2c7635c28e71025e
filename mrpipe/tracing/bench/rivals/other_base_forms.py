"""Comparison with other base forms that have the named effects, or fewer of them, in their best forms.

The race compares base forms with effects in simple forms. If the true effect has a richer form, a wrong base form with
one more effect can be better than the correct base form. The best rivals are therefore compared again once the named
effects are known, each with richer forms of the effects and adequate laws of the drive.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.fitting.reference import with_own_laws
from mrpipe.tracing.bench.base_forms.fits_of_forms import on_all_tests, with_effects_of
from mrpipe.tracing.bench.base_forms.promotion import winner_on_all_tests, with_candidates
from mrpipe.tracing.bench.base_forms.race import Model, Race
from mrpipe.tracing.bench.residuals.crossvalidation import gain_of, left_out_residual
from mrpipe.tracing.bench.selection.drive_again import with_adequate_laws
from mrpipe.tracing.bench.selection.refine import starts_of, with_best_forms
from mrpipe.tracing.bench.selection.select import Selection, fit_on_draft_tests

RIVALS = 3
"""Numerical technique: base forms, in addition to the chosen one, that are compared again."""

HOPELESS = 5.0
"""Numerical technique: richer forms are not tried if the simple ones have this multiple of the chi-square of the chosen
fit.
"""

RANKED_STEPS = 1
"""Numerical technique: number of steps of the fits that rank all base forms with the named effects ..."""

CONTINUED = 10
"""Numerical technique: ... number of the best ones that are fitted further ..."""

CONTINUED_STEPS = 3
"""Numerical technique: ... and number of their further steps."""

ITERATIONS = 15
"""Numerical technique: largest number of steps of a fit with another base form ..."""

TOLERANCE = 1e-3
"""Numerical technique: ... which ends when a step lowers the sum of squares by less than this share."""


@dataclass(frozen=True)
class Orders:
    """Largest degrees of the laws of the drive.

    Attributes
    ----------
    yield_order, viscosity_order
        Degree for the yield force and for the viscosity.
    """

    yield_order: int
    viscosity_order: int

    def adequate(self, found: Fit) -> Fit:
        """Return the fit with adequate laws of the drive."""
        return with_adequate_laws(found, self.yield_order, self.viscosity_order)


@dataclass(frozen=True)
class Unseen:
    """Comparison of two fits on tests left out of them.

    Attributes
    ----------
    folds, draws
        Number of folds of the cross-validation and of draws of its bootstrap.
    rng
        Source of randomness.
    """

    folds: int
    draws: int
    rng: np.random.Generator

    def better(self, before: Fit, after: Fit, jobs: int) -> bool:
        """Return whether the fit `after` predicts tests left out significantly better than `before`."""
        first, second = (left_out_residual(item, self.folds, jobs=jobs) for item in (before, after))
        return gain_of(first, second, after.problem, draws=self.draws, rng=self.rng).significant


def rivals_of(selection: Selection, race: Race | None) -> list[Model]:
    """Return models of the best other base forms whose effects are among those of the chosen fit, one for each form.

    Parameters
    ----------
    selection
        Chosen fit with its effects.
    race
        The models that competed; None where nothing is missing.
    """
    if race is None:
        return []
    chosen = selection.chosen.problem
    effects = {term.effect.name for term in chosen.terms}
    best: dict[str, tuple[float, Model]] = {}
    for cost, model in zip(race.costs(), race.models, strict=True):
        further = set(model.effects[len(race.own) :])
        if model.form == chosen.base.name or not further or not further <= effects:
            continue
        if model.form not in best or cost < best[model.form][0]:
            best[model.form] = (float(cost), model)
    return [model for _, model in sorted(best.values(), key=lambda item: item[0])[:RIVALS]]


def with_best_base(
    selection: Selection,
    declared: int,
    orders: Orders,
    race: Race | None,
    *,
    model_error: bool = False,
    worth_a_try: float,
    lead: float,
    unseen: Unseen,
    jobs: int = 1,
) -> Selection:
    """Return the selection with the base form that fits best, with the best forms of the effects.

    Parameters
    ----------
    selection
        Named effects with their fit.
    declared
        Number of terms that the campaign declares; they keep their forms.
    orders
        Largest degrees of the laws of the drive.
    race
        The models that competed; None where nothing is missing.
    model_error
        Whether the error of a model takes the place of the noise. This error can be that of a wrong base form, so that
        other base forms are then always compared.
    worth_a_try
        Other base forms are compared only if the excess of the chi-square over the noise, in units of the noise,
        exceeds this.
    lead
        Another base form is taken only if the chi-square of the chosen one exceeds its chi-square by this share.
    unseen
        Comparison on tests left out; the other base form must also predict these better.
    jobs
        Threads.
    """
    chosen = selection.chosen
    named = range(declared, min(declared + selection.proven, len(chosen.problem.terms)))
    limit = selection.sufficient(worth_a_try, model_error=model_error)
    if race is None or not named or chosen.chi_square < limit:
        return selection
    small = fit_on_draft_tests(chosen)
    places = range(len(small.problem.terms))
    full = with_best_forms(orders.adequate(small), named, jobs=jobs)
    if full.chi_square < limit:
        # only a richer form of the effect is missing
        return selection
    found = best_rival(selection, small, [places], declared, orders, race, jobs, full=full)
    if found is None:
        return selection
    rival, best = found
    if full.chi_square <= (1.0 + lead) * best.chi_square:
        return selection
    again = with_rival_base_form(selection, race, rival, best)
    own = on_all_tests(full, chosen.problem)
    if own.chi_square <= (1.0 + lead) * again.chosen.chi_square:
        return selection
    # a form with more freedom can fit the training tests better and predict other motions worse
    return with_candidates(again, race) if unseen.better(own, again.chosen, jobs) else selection


def with_base_of(rival: Model, small: Fit, places: Sequence[int], declared: int, orders: Orders) -> Fit:
    """Return some of the terms of a fit with the base form of a rival, on the same samples.

    Parameters
    ----------
    rival
        Model that gives the base form and its start.
    small
        Fit that gives the terms, their starts and the samples.
    places
        Indices of the terms that are kept.
    declared
        Number of terms that the campaign declares; they keep their forms.
    orders
        Largest degrees of the laws of the drive.
    """
    given = small.problem
    problem = replace(
        rival.fit.problem, terms=tuple(given.terms[k] for k in places), window_share=given.window_share
    ).on_samples_of(given)
    start = start_of(problem, rival.fit.base_values, [small.term_values[k] for k in places])
    found = with_own_laws(fit(problem, start, iterations=ITERATIONS, tolerance=TOLERANCE))
    if found.chi_square > HOPELESS * small.chi_square:
        return found
    return with_best_forms(orders.adequate(found), range(declared, len(places)))


def best_rival(
    selection: Selection,
    small: Fit,
    sets: Sequence[Sequence[int]],
    declared: int,
    orders: Orders,
    race: Race,
    jobs: int,
    full: Fit | None = None,
) -> tuple[Model, Fit] | None:
    """Return the best rival with one of several sets of terms, and its fit on the draft; None without a rival.

    Parameters
    ----------
    selection, small
        The selection, and the fit of its model on the draft.
    sets
        Sets of indices of the terms that are kept.
    declared
        Number of terms that the campaign declares; they keep their forms.
    orders
        Largest degrees of the laws of the drive.
    race
        The models that competed.
    jobs
        Threads.
    full
        Fit on the draft with the same terms in their best forms; with these, all base forms of the race are rivals.
        None if they are not tried.
    """
    trials: list[tuple[Model, Fit, Sequence[int]]] = [
        (rival, small, places) for rival in rivals_of(selection, race) for places in sets
    ]
    if full is not None:
        trials += _ranked(selection, full, sets, race, declared, jobs)
    if not trials:
        return None
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        fits = list(pool.map(lambda item: with_base_of(item[0], item[1], item[2], declared, orders), trials))
    best = min(range(len(trials)), key=lambda place: fits[place].chi_square)
    return trials[best][0], fits[best]


def _ranked(
    selection: Selection, full: Fit, sets: Sequence[Sequence[int]], race: Race, declared: int, jobs: int
) -> list[tuple[Model, Fit, Sequence[int]]]:
    """Return the best base forms with one of several sets of the terms of a fit; each with its fit and its terms.

    The race compares base forms with the simple forms of the effects, which change the force. If the true effect
    changes the yield force before the damper yields, the correct base form can be far from the best ones. All base
    forms are therefore compared with the forms of the named effects that do so.
    """
    others = {model.form for model in race.models} - {selection.chosen.problem.base.name}
    plain = {form: race.plain(form) for form in sorted(others)}
    problems = [item.fit.problem.on_samples_of(full.problem) for item in plain.values()]
    singles = [
        fit(replace(problem, window_share=full.problem.window_share), item.fit.theta, iterations=0)
        for problem, item in zip(problems, plain.values(), strict=True)
    ]
    trials: list[tuple[Model, Fit, Sequence[int]]] = []
    for places in sets:
        for shorter in _before_yielding(full, places, declared):
            for found in with_effects_of(shorter, singles, iterations=RANKED_STEPS, jobs=jobs):
                trials.append((plain[found.problem.base.name], found, range(len(places))))
    trials.sort(key=lambda item: item[1].chi_square)
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        nearer = pool.map(lambda item: (item[0], _further(item[1]), item[2]), trials[:CONTINUED])
        best = sorted(nearer, key=lambda item: item[1].chi_square)[:RIVALS]
    return [(replace(model, fit=found), found, places) for model, found, places in best]


def _further(begun: Fit) -> Fit:
    return with_own_laws(fit(begun.problem, begun.theta, iterations=CONTINUED_STEPS, tolerance=TOLERANCE))


def _before_yielding(full: Fit, places: Sequence[int], declared: int) -> Iterator[Fit]:
    """Yield a fit with some of its terms, and with each form of a named effect that acts before the damper yields.

    The simple forms of such an effect are linear in its strength. A form that is not is among the richer ones.
    """
    terms = [full.problem.terms[k] for k in places]
    values = [full.term_values[k] for k in places]
    choices = [(terms, values)]
    for place in range(declared, len(terms)):
        term = terms[place]
        if any(item.role == "strength" for form in term.effect.forms for item in form.parameters):
            continue
        for form in term.effect.refinements:
            if form.name != term.form.name and any(item.role == "strength" for item in form.parameters):
                start = next(starts_of(form, values[place], full.problem.scales))
                others = [*terms[:place], Term(term.effect, form), *terms[place + 1 :]]
                choices.append((others, [*values[:place], start, *values[place + 1 :]]))
    for chosen, given in choices:
        problem = replace(full.problem, terms=tuple(chosen))
        yield fit(problem, start_of(problem, full.base_values, given), iterations=0)


def with_rival_base_form(selection: Selection, race: Race, rival: Model, found: Fit) -> Selection:
    """Return the selection with a rival in place of the chosen fit, fitted to all training tests, without candidates.

    Parameters
    ----------
    selection
        The selection before.
    race
        The models that competed.
    rival
        Model of the race whose base form is taken.
    found
        The base form with its effects, fitted to the draft.
    """
    again = winner_on_all_tests(race, replace(rival, fit=found), selection.base)
    return replace(
        again.with_floor(selection.noise),
        proven=len(found.problem.terms) - len(race.own),
        nothing_missing=selection.nothing_missing,
        extension=selection.extension,
    )
