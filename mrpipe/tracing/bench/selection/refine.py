"""Improvement of a model after its effects are named: richer forms of the named effects, and further terms.

Flexible forms can imitate many effects, so as candidates they would make the names uncertain. Once an effect is named,
a richer form can lower the error where the simple forms do not fit. Further terms are effects whose cause is not
proven. Both are kept only if they improve the prediction of tests left out.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.parameters import Parameter
from mrpipe.dampers.plant import CHAIN_LENGTH
from mrpipe.effects.contract import EffectForm, EffectScales
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.residuals.crossvalidation import gain_of, left_out_residual
from mrpipe.tracing.bench.selection.select import Selection, fit_on_draft_tests
from mrpipe.tracing.rules import RefinementRules

NO_STRENGTH = 1e-3
"""Numerical technique: a strength below this share of its upper bound counts as zero."""

CONFIRMED = 3
"""Numerical technique: largest number of richer forms of an effect that are judged on tests left out."""


def with_richer_forms(
    selection: Selection,
    declared: int,
    *,
    folds: int,
    draws: int,
    rng: np.random.Generator,
    model_error: bool = False,
    jobs: int = 1,
    rules: RefinementRules | None = None,
) -> Selection:
    """Return the selection with richer forms of its named effects, if these predict tests left out better.

    Parameters
    ----------
    selection
        Named effects with their fit.
    declared
        Number of terms that the campaign declares; they keep their forms.
    folds, draws
        Number of folds of the cross-validation, and of draws of its bootstrap.
    rng
        Source of randomness.
    model_error
        Whether residuals are weighted by an expected error of the model.
    jobs
        Threads; the result does not depend on their number.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or RefinementRules()
    chosen = selection.chosen
    confirmed = partial(_confirmed, folds=folds, draws=draws, rng=rng, jobs=jobs, rules=rules)
    unseen: FloatArray | None = None
    for place in range(declared, min(declared + selection.proven, len(chosen.problem.terms))):
        # if weights follow from the error of the model, they do not show whether a structure remains
        if not model_error and chosen.chi_square < (1.0 + rules.worth_a_try) * selection.noise:
            break
        for richer in _richer(chosen, place, CONFIRMED, jobs):
            if richer.chi_square > (1.0 - rules.least_gain) * chosen.chi_square:
                continue
            if unseen is None:
                unseen = left_out_residual(chosen, folds, jobs=jobs)
            trial = confirmed(unseen, richer)
            if trial is not None:
                chosen, unseen = richer, trial
                break
    return replace(selection, chosen=chosen)


def with_further_terms(
    selection: Selection,
    *,
    folds: int,
    draws: int,
    rng: np.random.Generator,
    jobs: int = 1,
    rules: RefinementRules | None = None,
) -> Selection:
    """Return the selection with the terms of its extension if they lower the error on tests that were left out.

    Parameters
    ----------
    selection
        Named effects with their fit, and the extension that is considered.
    folds, draws
        Number of folds of the cross-validation, and of draws of its bootstrap.
    rng
        Source of randomness.
    jobs
        Threads; the result does not depend on their number.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or RefinementRules()
    chosen, extension = selection.chosen, selection.extension
    if extension is None:
        return selection
    count = len(chosen.problem.terms)
    if [item.effect for item in extension.problem.terms[:count]] != [item.effect for item in chosen.problem.terms]:
        return selection
    problem = replace(chosen.problem, terms=(*chosen.problem.terms, *extension.problem.terms[count:]))
    further = zip(extension.problem.terms[count:], extension.term_values[count:], strict=True)
    if len(chosen.steps()) + sum(len(term.form.steps(values)) for term, values in further) >= CHAIN_LENGTH:
        return selection
    start = start_of(problem, chosen.base_values, [*chosen.term_values, *extension.term_values[count:]])
    longer = fit(problem, start, iterations=15)
    if longer.chi_square > (1.0 - rules.least_gain) * chosen.chi_square:
        return selection
    unseen = left_out_residual(chosen, folds, jobs=jobs)
    if _confirmed(unseen, longer, folds=folds, draws=draws, rng=rng, jobs=jobs, rules=rules) is None:
        return selection
    return replace(selection, chosen=longer, named_fit=chosen)


def _confirmed(
    unseen: FloatArray,
    trial: Fit,
    *,
    folds: int,
    draws: int,
    rng: np.random.Generator,
    jobs: int,
    rules: RefinementRules,
) -> FloatArray | None:
    """Return the residual of a trial on tests left out of its fit, if it is clearly less than `unseen`; else None."""
    residual = left_out_residual(trial, folds, jobs=jobs)
    gain = gain_of(unseen, residual, trial.problem, draws=draws, rng=rng)
    return residual if gain.significant and gain.share > rules.least_gain else None


def with_best_forms(found: Fit, places: Sequence[int], rounds: int = 2, *, jobs: int = 1) -> Fit:
    """Return the fit with the best forms of its terms at `places`, chosen one after another on all tests.

    Parameters
    ----------
    found
        The fit.
    places
        Which of its terms may take another form.
    rounds
        Numerical technique: number of passes over the terms, because a better form of one term changes the others.
    jobs
        Threads; the result does not depend on their number.
    """
    for _ in range(rounds):
        before = found
        for place in places:
            found = min([found, *_richer(found, place, 1, jobs)], key=lambda item: item.chi_square)
        if found is before:
            break
    return found


def _richer(chosen: Fit, place: int, count: int, jobs: int = 1) -> Iterator[Fit]:
    """Yield fits with other forms of one term on all tests, ranked on a share of the tests.

    Simple forms are tried as well as richer ones, because the other terms and the laws of the drive have changed since
    the search. A form with a shape parameter at a bound is not yielded.

    Parameters
    ----------
    chosen, place
        The fit, and which of its terms takes other forms.
    count
        Number of forms that are fitted to all tests.
    jobs
        Threads; the result does not depend on their number.
    """
    term = chosen.problem.terms[place]
    forms = [form for form in (*term.effect.refinements, *term.effect.forms) if form.name != term.form.name]
    small = fit_on_draft_tests(chosen)
    starts = [
        (form, given)
        for form in forms
        for given in starts_of(form, small.term_values[place], small.problem.scales)
        if _fits_in_chain(chosen, place, form)
    ]
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        trials = sorted(pool.map(lambda start: _trial(small, place, *start), starts), key=lambda item: item.cost)
    best = {trial.problem.terms[place].form.name: trial for trial in reversed(trials)}
    for trial in sorted(best.values(), key=lambda item: item.cost)[:count]:
        found = fit(replace(chosen.problem, terms=trial.problem.terms), trial.theta, iterations=25)
        shapes = {
            item.name
            for item in trial.problem.terms[place].form.parameters
            if item.role != "amplitude" and not _is_absent(item, found, place)
        }
        if not shapes & (set(found.at_bound) - set(chosen.at_bound)):
            yield found


def _is_absent(item: Parameter, found: Fit, place: int) -> bool:
    """Return whether a strength is zero within tolerance, because a search within bounds ends just above zero."""
    largest = item.bounds(found.problem.scales)[1]
    return item.role == "strength" and abs(found.term_values[place][item.name]) <= NO_STRENGTH * largest


def _fits_in_chain(chosen: Fit, place: int, form: EffectForm) -> bool:
    """Return whether the damper with another form of one term has at most the largest number of steps of a chain."""
    others = len(chosen.steps()) - len(chosen.problem.terms[place].form.steps(chosen.term_values[place]))
    # one further step sums the parts of the base form
    return others + len(form.steps(form.without_strength(chosen.problem.scales))) < CHAIN_LENGTH


def starts_of(form: EffectForm, known: Mapping[str, float], scales: EffectScales) -> Iterator[dict[str, float]]:
    """Yield starts: fitted values of the simple form for parameters of the same name, else the starts of the form.

    For a strength with distant starts these are tried too, because the simple form may have ended in another minimum.
    """

    def choices(item: Parameter) -> tuple[float, ...]:
        own = item.start_values(scales)
        low, high = item.bounds(scales)
        if not low <= known.get(item.name, np.nan) <= high:
            return own
        return known[item.name], *(own[1:] if item.role == "strength" else ())

    for values in itertools.product(*(choices(item) for item in form.searched)):
        yield dict(zip((p.name for p in form.searched), values, strict=True))


def _trial(small: Fit, place: int, form: EffectForm, given: Mapping[str, float]) -> Fit:
    terms = list(small.problem.terms)
    terms[place] = Term(terms[place].effect, form)
    values = list(small.term_values)
    values[place] = dict(given)
    problem = replace(small.problem, terms=tuple(terms))
    return fit(problem, start_of(problem, small.base_values, values), iterations=6, tolerance=2e-3)
