"""Which effects: screening, joint refits from several starts, forward selection, each kept only for a fair share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.fitting.engine import Fit, fit, solve, start_of
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import Recordings
from mrpipe.fitting.weighting import weighting
from mrpipe.tracing.bench.crossvalidation import folds_of
from mrpipe.tracing.bench.screen import Screened, screen
from mrpipe.tracing.rules import SelectionRules

DRAFT_SAMPLES = 8_000
"""Numerical technique: samples, or slightly more, on which all forms are drafted ..."""

MOST_PARTS = 4
"""Numerical technique: ... but at least this part of the tests."""

BEGUN_STEPS = 3
"""Numerical technique: iterations after which the most promising forms are chosen ..."""

CONTINUED = 8
"""Numerical technique: ... and number of forms that are then fitted further."""

DISTANT_STEPS = 6
"""Numerical technique: iterations of a refit from a distant start of a strength, before which it cannot be judged."""

_Item = TypeVar("_Item")


@dataclass(frozen=True)
class Candidate:
    """A family in its best form, fitted jointly.

    Attributes
    ----------
    name
        Of the effect.
    fit
        With the terms chosen before and this one, which is the last.
    share
        Share of the recoverable residual of the base that the whole set recovers.
    forms
        Share of each form that was tried.
    """

    name: str
    fit: Fit
    share: float
    forms: dict[str, float]


@dataclass(frozen=True)
class Selection:
    """What forward selection found.

    Attributes
    ----------
    base, noise
        Fit of the base; chi-square of the noise.
    rounds
        Candidates of each round, best first.
    chosen
        The fit kept (the base where none was).
    proven
        How many of the rounds name a cause; terms of later rounds improve the model, their cause is not proven.
    ground
        Fit without effects that the rounds build on: the base, or another base form that the tests need.
    tied_forms
        Other base forms that are not clearly worse with the same effects.
    extension
        Fit with further terms, whose cause is not proven, until it is known whether left-out tests confirm them.
    named_fit
        Fit with the named effects alone, where `chosen` holds further terms.
    nothing_missing
        Excess of the chi-square over the noise, in units of the noise, below which nothing is missing.
    """

    base: Fit
    noise: float
    rounds: tuple[tuple[Candidate, ...], ...]
    chosen: Fit
    proven: int = 3
    ground: Fit | None = None
    tied_forms: tuple[str, ...] = ()
    extension: Fit | None = None
    named_fit: Fit | None = None
    nothing_missing: float = SelectionRules().nothing_missing

    @property
    def without_effects(self) -> Fit:
        """Return the fit that the rounds build on."""
        return self.base if self.ground is None else self.ground

    @property
    def with_named_alone(self) -> Selection:
        """Return the same without terms whose cause is not proven."""
        return self if self.named_fit is None else replace(self, chosen=self.named_fit, named_fit=None)

    @property
    def recoverable(self) -> float:
        """Excess of the base's chi-square over the noise."""
        return max(self.base.chi_square - self.noise, 0.0)

    @property
    def structured(self) -> bool:
        """Whether anything is missing at all."""
        return self.recoverable > self.nothing_missing * self.noise

    def with_floor(self, floor: float) -> Selection:
        """Return the same with another estimate of what cannot be recovered; shares follow."""
        rounds = tuple(
            tuple(replace(item, share=share_of(self.base, item.fit, floor)) for item in candidates)
            for candidates in self.rounds
        )
        return replace(self, noise=floor, rounds=rounds)

    def share(self, found: Fit) -> float:
        """Return the share of the recoverable residual that a fit recovers."""
        return share_of(self.base, found, self.noise)


def share_of(base: Fit, found: Fit, noise: float) -> float:
    """Return the share of the base's excess over noise that a fit recovers, at most 1."""
    excess = max(base.chi_square - noise, 1e-12)
    return float(min(1.0, (base.chi_square - found.chi_square) / excess))


def left_of(found: Fit, noise: float, share: float) -> float:
    """Return the excess of the chi-square over the noise, plus a share of the noise that does not separate fits."""
    return max(found.chi_square - noise, 0.0) + share * noise


def draft_tests(recordings: Recordings) -> list[int]:
    """Return the indices of a share of the tests that still holds every drive level; all where there are few."""
    parts = min(-(-len(recordings.force) // DRAFT_SAMPLES), MOST_PARTS, recordings.tests // 4)
    return folds_of(recordings, max(1, parts))[0]


def draft(found: Fit) -> Fit:
    """Return the fit on a share of its tests that still holds every drive level: enough to screen and to rank forms."""
    recordings = found.problem.recordings
    keep = draft_tests(recordings)
    if len(keep) == recordings.tests:
        return found
    within = np.isin(recordings.test, keep)
    problem = replace(found.problem, recordings=recordings.subset(keep), root_weight=found.problem.root_weight[within])
    return fit(problem, found.theta, iterations=4)


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
    """Fit the terms of a draft on all tests of `before`, from where the draft ended.

    What both share starts from the draft or from `before`, whichever is nearer: on a share of the tests it may have
    gone where the others do not follow.
    """
    problem = replace(before.problem, terms=(*before.problem.terms, drafted.problem.terms[-1]))
    both = [drafted.theta, np.concatenate([before.theta, drafted.theta[len(before.theta) :]])]
    w = weighting(problem)
    start = min(both, key=lambda theta: solve(problem, theta, w).cost)
    return fit(problem, start, iterations=iterations)


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
) -> list[Candidate]:
    """Screen all terms after a fit and refit the families that promise most; best first.

    Forms are tried on a share of the tests; those that may win are fitted on all of them.
    """
    rules = rules or SelectionRules()
    penalised = partial(_penalised, share=rules.per_parameter)
    present = {term.effect.name for term in before.problem.terms}
    small = draft(before)
    ranked = screen(small, [term for term in terms if term.effect.name not in present], jobs=jobs)
    families: dict[str, list[Screened]] = {}
    for item in ranked:
        families.setdefault(item.term.effect.name, []).append(item)
    chosen = list(families)[:refits]
    begun = partial(refit, small, iterations=BEGUN_STEPS)
    drafts = _each(begun, [item for name in chosen for item in families[name][:2]], jobs)
    # the families in front get all their forms: a name is judged by the form that suits it best
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
        found.append(Candidate(name, winner, share_of(base, winner, noise), shares))
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


def _nothing_more(before: Fit, terms: Sequence[Term], least: float, jobs: int) -> bool:
    present = {term.effect.name for term in before.problem.terms}
    small = draft(before)
    ranked = screen(small, [term for term in terms if term.effect.name not in present], jobs=jobs)
    return ranked[0].gain * small.chi_square < least


def admissible(found: Fit, main_part: float = SelectionRules().main_part) -> bool:
    """Return whether the last term of a fit may be named: it does something and no strength sits at a bound."""
    term, values = found.problem.terms[-1], found.term_values[-1]
    for item in term.form.parameters:
        if item.role in ("strength", "amplitude") and len(term.form.amplitudes) <= 1 and item.name in found.at_bound:
            return False
    amplitudes = term.form.amplitudes
    if len(amplitudes) > 1 and amplitudes[0].lower == 0.0 and all(item.lower < 0.0 for item in amplitudes[1:]):
        # without the part of definite sign only its corrections remain: a spring needs a stiffness
        main, *corrections = (abs(values[p.name]) / found.problem.scales.of(p.scale) for p in amplitudes)
        if main <= main_part * max(corrections):
            return False
    return any(values[item.name] != 0.0 for item in term.form.parameters if item.role != "shape")


def stuck(found: Fit) -> set[str]:
    """Return what sits at a bound; but one of several amplitudes of a form at zero is a part that is not there."""
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
    """Add effects one after another while each recovers a fair share.

    A further term counts as a separate cause only where it recovers much of the rest and leads the other families.
    Otherwise it may correct the form of the effect before it, and so may all terms that follow.
    """
    rules = rules or SelectionRules()
    rounds: list[tuple[Candidate, ...]] = []
    chosen, proven, sure, again = base, 0, True, False
    excess = max(base.chi_square - noise, 0.0)
    if excess <= rules.nothing_missing * noise or most == 0:
        return Selection(base, noise, (), base, nothing_missing=rules.nothing_missing)
    while len(rounds) < most:
        little = chosen.chi_square - noise < min(rules.further * excess, (rules.near_floors**2 - 1.0) * noise)
        if rounds and little and _nothing_more(chosen, terms, rules.gain * excess, jobs):
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
        able = [item for item in found if admissible(item.fit, rules.main_part)]
        if rounds and rules.lead > 1.0:
            # with other effects present, a parameter at its bound corrects a form, and it extrapolates badly
            able = [item for item in able if stuck(item.fit) <= stuck(chosen)]
        ordered = tuple(able + [item for item in found if item not in able])
        gain = chosen.chi_square - able[0].fit.chi_square if able else 0.0
        left = chosen.chi_square - noise
        if not able or (rounds and (gain < rules.gain * excess or gain < rules.term_share * left)):
            rounds.append(ordered)
            break
        nearer = chosen if not rounds or again else _nearer(chosen, able[0].fit, rules.better_optimum)
        again = nearer is not chosen
        if again:
            # the term had only shown the way to a better optimum of the others: look again from there
            rounds[-1] = tuple(_with_fit(item, chosen, nearer, base, noise) for item in rounds[-1])
            chosen = nearer
            continue
        rounds.append(ordered)
        if len(rounds) > 1:
            sure = sure and gain >= rules.named_share * left and _leads(ordered, noise, rules)
        proven += int(sure)
        chosen = able[0].fit
        if chosen.chi_square - noise < max(rules.nothing_missing * noise, rules.gain * excess):
            break
    return Selection(base, noise, tuple(rounds), chosen, proven, nothing_missing=rules.nothing_missing)


def _nearer(chosen: Fit, best: Fit, share: float) -> Fit:
    """Return the fit without the last term of `best`, begun where that ended, if it is clearly better than before."""
    trial = fit(chosen.problem, best.theta[: len(chosen.theta)], iterations=6)
    return trial if trial.chi_square < (1.0 - share) * chosen.chi_square else chosen


def _with_fit(item: Candidate, old: Fit, new: Fit, base: Fit, noise: float) -> Candidate:
    return replace(item, fit=new, share=share_of(base, new, noise)) if item.fit is old else item


def _leads(candidates: Sequence[Candidate], noise: float, rules: SelectionRules) -> bool:
    if len(candidates) < 2:
        return True
    best, second = (left_of(item.fit, noise, rules.same) for item in candidates[:2])
    return second >= rules.lead * best
