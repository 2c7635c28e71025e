"""Choice of the effects: screening, joint refits from several starts, and forward selection with a least share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.fitting.engine import Fit, fit
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.reference import with_settled_laws
from mrpipe.fitting.start import tests_of_varying_drive
from mrpipe.tracing.bench.residuals.crossvalidation import folds_of
from mrpipe.tracing.bench.selection.refit import on_all, refit
from mrpipe.tracing.bench.selection.screen import Screened, screen
from mrpipe.tracing.rules import SelectionRules

DRAFT_SAMPLES = 8_000
"""Numerical technique: least number of samples of the draft, to which all forms are fitted ..."""

MOST_PARTS = 4
"""Numerical technique: ... but at least one in this number of tests."""

BEGUN_STEPS = 3
"""Numerical technique: number of iterations after which the best forms are chosen ..."""

CONTINUED = 8
"""Numerical technique: ... and number of forms that are then fitted further."""

LAWS_AGAIN = 6
"""Numerical technique: number of candidates of a round whose effects take the laws of their own fit."""

_Item = TypeVar("_Item")


@dataclass(frozen=True)
class EffectCandidate:
    """An effect in its best form, fitted jointly with the model.

    Attributes
    ----------
    name
        Name of the effect.
    fit
        Fit with the terms that were chosen before, and with this one as the last term.
    share
        Share of the recoverable residual of the base that all terms together recover.
    forms
        Form -> share, of all forms that were tried.
    """

    name: str
    fit: Fit
    share: float
    forms: dict[str, float]


@dataclass(frozen=True)
class Selection:
    """Result of the forward selection.

    Attributes
    ----------
    base, noise
        Fit of the base model; chi-square of the noise.
    rounds
        Candidates of each round, best first.
    chosen
        The chosen fit; the base if no effect was taken.
    proven
        Number of rounds whose terms are named. Terms of later rounds improve the model, but their cause is not proven.
    ground
        Fit without effects that the rounds start from: the base, or another base form that the tests require.
    tied_forms
        Other base forms that are not clearly worse with the same effects.
    extension
        Fit with further terms, whose cause is not proven, before tests left out have confirmed them.
    named_fit
        Fit with the named effects alone, if `chosen` has further terms.
    nothing_missing
        Excess of the chi-square over the noise, in units of the noise, below which nothing is missing.
    """

    base: Fit
    noise: float
    rounds: tuple[tuple[EffectCandidate, ...], ...]
    chosen: Fit
    proven: int = 3
    ground: Fit | None = None
    tied_forms: tuple[str, ...] = ()
    extension: Fit | None = None
    named_fit: Fit | None = None
    nothing_missing: float = SelectionRules().nothing_missing

    @property
    def without_effects(self) -> Fit:
        """Return the fit that the rounds start from."""
        return self.base if self.ground is None else self.ground

    @property
    def with_named_alone(self) -> Selection:
        """Return the selection without terms whose cause is not proven."""
        return self if self.named_fit is None else replace(self, chosen=self.named_fit, named_fit=None)

    @property
    def recoverable(self) -> float:
        """Excess of the chi-square of the base over that of the noise."""
        return max(self.base.chi_square - self.noise, 0.0)

    @property
    def structured(self) -> bool:
        """Whether anything is missing at all."""
        return self.recoverable > self.nothing_missing * self.noise

    def sufficient(self, worth_a_try: float, *, model_error: bool) -> float:
        """Return the chi-square up to which nothing more is tried; 0 if a model error takes the place of the noise.

        Parameters
        ----------
        worth_a_try
            Excess over the noise, in units of the noise, that is worth a try.
        model_error
            Whether weights follow from the error of a model, which may be that of a wrong base form.
        """
        return 0.0 if model_error else (1.0 + worth_a_try) * self.noise

    def with_floor(self, floor: float) -> Selection:
        """Return the selection with another estimate of the chi-square that cannot be recovered; shares are updated."""
        rounds = tuple(
            tuple(replace(item, share=share_of(self.base, item.fit, floor)) for item in candidates)
            for candidates in self.rounds
        )
        return replace(self, noise=floor, rounds=rounds)

    def share(self, found: Fit) -> float:
        """Return the share of the recoverable residual that a fit recovers."""
        return share_of(self.base, found, self.noise)


def share_of(base: Fit, found: Fit, noise: float) -> float:
    """Return the share of the excess of the base over noise that a fit recovers, at most 1."""
    excess = max(base.chi_square - noise, 1e-12)
    return float(min(1.0, (base.chi_square - found.chi_square) / excess))


def excess_over_noise(found: Fit, noise: float, share: float) -> float:
    """Return the excess of the chi-square over the noise, plus a share of the noise within which fits are equal."""
    return max(found.chi_square - noise, 0.0) + share * noise


def draft_tests(recordings: Recordings) -> list[int]:
    """Return the indices of a share of the tests that still holds every drive level; all where there are few.

    Tests of constant and of varying drive are drawn separately. Otherwise a draft may hold no step of the drive, and
    the screening of the draft finds no effect that follows such steps.
    """
    parts = max(1, min(-(-len(recordings.force) // DRAFT_SAMPLES), MOST_PARTS, recordings.tests // 4))
    varying = tests_of_varying_drive(recordings)
    groups = (np.flatnonzero(kind).tolist() for kind in (varying, ~varying))
    return sorted(index for group in groups for index in folds_of(recordings, parts, group)[0])


def fit_on_draft_tests(found: Fit) -> Fit:
    """Return the fit on the tests of :func:`draft_tests`, which suffice to screen and to rank forms."""
    recordings = found.problem.recordings
    keep = draft_tests(recordings)
    if len(keep) == recordings.tests:
        return found
    within = np.isin(recordings.test, keep)
    problem = replace(found.problem, recordings=recordings.subset(keep), root_weight=found.problem.root_weight[within])
    return fit(problem, found.theta, iterations=4)


def candidates_after(
    before: Fit,
    base: Fit,
    noise: float,
    terms: Sequence[Term],
    *,
    refits: int,
    rules: SelectionRules | None = None,
    jobs: int,
    progress: Progress = no_progress,
) -> list[EffectCandidate]:
    """Screen all terms after a fit, and refit the best families; the best candidate is first.

    Forms are tried on a share of the tests; the best ones are fitted to all tests.
    """
    rules = rules or SelectionRules()
    penalised = partial(_penalised, share=rules.per_parameter)
    small = fit_on_draft_tests(before)
    ranked = screen(small, _not_present(terms, before), jobs=jobs)
    families: dict[str, list[Screened]] = {}
    for item in ranked:
        families.setdefault(item.term.effect.name, []).append(item)
    chosen = list(families)[:refits]
    begun = partial(refit, small, iterations=BEGUN_STEPS)
    drafts = _each(begun, [item for name in chosen for item in families[name][:2]], jobs)
    # all forms of the best families are tried: an effect is judged by the form that suits it best
    front = sorted(chosen, key=lambda name: min(item.cost for item in drafts if _name(item) == name))[:3]
    drafts += _each(begun, [item for name in front for item in families[name][2:]], jobs)
    drafts.sort(key=penalised)
    drafts = _each(_continued, drafts[:CONTINUED], jobs) + drafts[CONTINUED:]
    progress(0.7, f"{len(drafts)} forms tried")
    own = {name: sorted((item for item in drafts if _name(item) == name), key=penalised) for name in chosen}
    if small is before:
        fits = drafts
    else:
        least = min(items[0].chi_square for items in own.values())
        within = least + rules.contender_share * max(small.chi_square - least, 0.0)
        contenders = [item for items in own.values() for item in items[:3] if item.chi_square <= within]
        others = [items[0] for items in own.values() if items[0].chi_square > within]
        fits = _each(lambda item: on_all(before, item, iterations=10), contenders, jobs)
        fits += _each(lambda item: on_all(before, item, iterations=1), others, jobs)
    already = share_of(base, before, noise)
    found = []
    for name in chosen:
        winner = min((item for item in fits if _name(item) == name), key=penalised)
        shares = {_form(item): already + (1.0 - already) * share_of(small, item, noise) for item in own[name]}
        shares |= {_form(item): share_of(base, item, noise) for item in fits if _name(item) == name}
        found.append(EffectCandidate(name, winner, share_of(base, winner, noise), shares))
    return sorted(found, key=lambda item: item.fit.chi_square)


def _continued(begun: Fit) -> Fit:
    return fit(begun.problem, begun.theta, iterations=6, tolerance=2e-3)


def _name(found: Fit) -> str:
    return found.problem.terms[-1].effect.name


def _form(found: Fit) -> str:
    return found.problem.terms[-1].form.name


def _penalised(found: Fit, share: float) -> float:
    # prefer the simpler of two forms that fit alike
    searched = sum(len(term.form.parameters) for term in found.problem.terms)
    return found.chi_square * (1.0 + share * searched)


def _each(work: Callable[[_Item], Fit], items: Sequence[_Item], jobs: int) -> list[Fit]:
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return list(pool.map(work, items))


def _not_present(terms: Sequence[Term], found: Fit) -> list[Term]:
    """Return the terms whose effect is not yet part of a fit."""
    present = {term.effect.name for term in found.problem.terms}
    return [term for term in terms if term.effect.name not in present]


def _nothing_more(before: Fit, terms: Sequence[Term], least: float, jobs: int) -> bool:
    small = fit_on_draft_tests(before)
    ranked = screen(small, _not_present(terms, before), jobs=jobs)
    return ranked[0].gain * small.chi_square < least


def last_term_may_be_named(found: Fit, main_part: float = SelectionRules().main_part) -> bool:
    """Return whether the last term of a fit may be named: it has an effect, and no strength is at a bound."""
    term, values = found.problem.terms[-1], found.term_values[-1]
    for item in term.form.parameters:
        if item.role in ("strength", "amplitude") and len(term.form.amplitudes) <= 1 and item.name in found.at_bound:
            return False
    amplitudes = term.form.amplitudes
    if len(amplitudes) > 1 and amplitudes[0].lower == 0.0 and all(item.lower < 0.0 for item in amplitudes[1:]):
        # without the part of definite sign only corrections remain: a spring needs a stiffness
        main, *corrections = (abs(values[p.name]) / found.problem.scales.of(p.scale) for p in amplitudes)
        if main <= main_part * max(corrections):
            return False
    return any(values[item.name] != 0.0 for item in term.form.parameters if item.role != "shape")


def parameters_at_bound(found: Fit) -> set[str]:
    """Return the parameters at a bound, except one of several amplitudes at zero, because that part is absent."""
    absent = {
        item.name
        for term, values in zip(found.problem.terms, found.term_values, strict=True)
        for item in term.form.amplitudes
        if item.lower == 0.0 and values[item.name] == 0.0 and len(term.form.amplitudes) > 1
    }
    return set(found.at_bound) - absent


def forward_selection(
    base: Fit,
    noise: float,
    terms: Sequence[Term],
    *,
    most: int = 3,
    refits: int = 8,
    rules: SelectionRules | None = None,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Selection:
    """Add effects one after another, while each recovers a sufficient share.

    The base of the result differs from `base` if an effect led to a better optimum of its parameters. A further term
    counts as a separate cause only if it recovers a large share of the remaining residual and is clearly better than
    the other families. Otherwise it, and every later term, may only correct the form of an earlier effect.
    """
    rules = rules or SelectionRules()
    rounds: list[tuple[EffectCandidate, ...]] = []
    chosen, proven, sure, again = base, 0, True, False
    excess = max(base.chi_square - noise, 0.0)
    if excess <= rules.nothing_missing * noise or most == 0:
        return Selection(base, noise, (), base, nothing_missing=rules.nothing_missing)
    # of a large excess even a small share is clearly more than noise
    enough = min(rules.gain * excess, (rules.clear_floors**2 - 1.0) * noise)
    while len(rounds) < most and _not_present(terms, chosen):
        little = chosen.chi_square - noise < min(rules.further * excess, (rules.near_floors**2 - 1.0) * noise)
        if rounds and little and _nothing_more(chosen, terms, enough, jobs):
            break
        found = candidates_after(
            chosen,
            base,
            noise,
            terms,
            refits=refits,
            rules=rules,
            jobs=jobs,
            progress=progress,
        )
        nearer = chosen if rounds else _nearer(chosen, found[0].fit, rules.better_optimum)
        if nearer is not chosen:
            # an effect has only led to a better optimum of the base: what is missing is judged from there
            return forward_selection(
                nearer, noise, terms, most=most, refits=refits, rules=rules, jobs=jobs, progress=progress
            )
        found = _with_laws_of_their_own(found, base, noise, jobs)
        able = [item for item in found if last_term_may_be_named(item.fit, rules.main_part)]
        if rounds and rules.lead > 1.0:
            # with other effects present, a parameter at its bound corrects a form, and it extrapolates badly
            able = [item for item in able if parameters_at_bound(item.fit) <= parameters_at_bound(chosen)]
        ordered = tuple(able + [item for item in found if item not in able])
        gain = chosen.chi_square - able[0].fit.chi_square if able else 0.0
        left = chosen.chi_square - noise
        if not able or (rounds and gain < max(enough, rules.term_share * left)):
            rounds.append(ordered)
            break
        nearer = chosen if not rounds or again else _nearer(chosen, able[0].fit, rules.better_optimum)
        again = nearer is not chosen
        if again:
            # the term had only led to a better optimum of the other terms: search again from there
            rounds[-1] = tuple(_with_fit(item, chosen, nearer, base, noise) for item in rounds[-1])
            chosen = nearer
            continue
        rounds.append(ordered)
        if len(rounds) > 1:
            sure = sure and gain >= rules.named_share * left and _leads(ordered, noise, rules)
        proven += int(sure)
        chosen = able[0].fit
        if chosen.chi_square - noise < max(rules.nothing_missing * noise, enough):
            break
    return Selection(base, noise, tuple(rounds), chosen, proven, nothing_missing=rules.nothing_missing)


def _with_laws_of_their_own(
    found: Sequence[EffectCandidate], base: Fit, noise: float, jobs: int
) -> list[EffectCandidate]:
    """Return the candidates, the best ones with effects proportional to the laws of the drive of their own fit.

    All were fitted with the laws of the fit before. A large effect changes the laws, and an error in one effect hides
    the next one.
    """
    fits = _each(lambda item: with_settled_laws(item.fit), found[:LAWS_AGAIN], jobs)
    again = [_with_fit(item, item.fit, new, base, noise) for item, new in zip(found, fits, strict=False)]
    return sorted([*again, *found[LAWS_AGAIN:]], key=lambda item: item.fit.chi_square)


def _nearer(chosen: Fit, best: Fit, share: float) -> Fit:
    """Return a fit without the last term of `best`, started from `best`, if it is clearly better than `chosen`."""
    trial = fit(chosen.problem, best.theta[: len(chosen.theta)], iterations=6)
    return trial if trial.chi_square < (1.0 - share) * chosen.chi_square else chosen


def _with_fit(item: EffectCandidate, old: Fit, new: Fit, base: Fit, noise: float) -> EffectCandidate:
    return replace(item, fit=new, share=share_of(base, new, noise)) if item.fit is old else item


def _leads(candidates: Sequence[EffectCandidate], noise: float, rules: SelectionRules) -> bool:
    if len(candidates) < 2:
        return True
    best, second = (excess_over_noise(item.fit, noise, rules.same) for item in candidates[:2])
    return second >= rules.lead * best
