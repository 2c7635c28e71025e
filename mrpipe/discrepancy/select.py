"""Which effects: screening, joint refits from several starts, forward selection, each kept only for a fair share."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from mrpipe.artifacts import Progress, no_progress
from mrpipe.discrepancy.engine import Fit, fit, start_of
from mrpipe.discrepancy.problem import Term
from mrpipe.discrepancy.screen import Screened, screen

NOTHING_MISSING = 0.2
"""Excess of the chi-square over the noise, in units of the noise, below which nothing is missing."""

SECOND_GAIN = 0.05
"""A further effect must recover at least this share of what the base lacked ..."""

SECOND_SHARE = 0.5
"""... and at least this share of what the effects before it left."""


FURTHER = 0.15
"""Where less than this share is left, a further effect is looked for only if the screening promises its share."""


@dataclass(frozen=True)
class Candidate:
    """A family in its best form, fitted jointly.

    Attributes
    ----------
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
    """

    base: Fit
    noise: float
    rounds: tuple[tuple[Candidate, ...], ...]
    chosen: Fit

    @property
    def recoverable(self) -> float:
        """Excess of the base's chi-square over the noise."""
        return max(self.base.chi_square - self.noise, 0.0)

    @property
    def structured(self) -> bool:
        """Whether anything is missing at all."""
        return self.recoverable > NOTHING_MISSING * self.noise

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


def refit(before: Fit, screened: Screened, *, iterations: int = 15) -> Fit:
    """Fit the terms of `before` and a screened one jointly."""
    problem = replace(before.problem, terms=(*before.problem.terms, screened.term))
    start = start_of(problem, before.base_values, [*before.term_values, screened.values])
    start[: len(before.theta)] = before.theta
    return fit(problem, start, iterations=iterations)


def candidates_after(
    before: Fit,
    base: Fit,
    noise: float,
    terms: Sequence[Term],
    *,
    refits: int,
    jobs: int,
    progress: Progress = no_progress,
) -> list[Candidate]:
    """Screen all terms after a fit and refit the families that promise most; best first."""
    present = {term.effect.name for term in before.problem.terms}
    ranked = screen(before, [term for term in terms if term.effect.name not in present], jobs=jobs)
    families: dict[str, list[Screened]] = {}
    for item in ranked:
        families.setdefault(item.term.effect.name, []).append(item)
    chosen = list(families.items())[:refits]
    work = [(name, item) for name, items in chosen for item in items[:2]]
    fits = _refit_all(before, work, jobs)
    done = {item.term.key for _, item in work}
    # the families in front get all their forms: a name is judged by the form that suits it best
    best = sorted({name: min(f.chi_square for n, f in fits if n == name) for name, _ in chosen}.items(), key=_second)
    more = [(name, item) for name, _ in best[:3] for item in families[name] if item.term.key not in done]
    progress(0.7, f"{len(work)} forms refitted")
    fits += _refit_all(before, more, jobs)
    found = []
    for name, _ in chosen:
        own = [item for n, item in fits if n == name]
        winner = min(own, key=_penalised)
        shares = {item.problem.terms[-1].form.name: share_of(base, item, noise) for item in own}
        found.append(Candidate(name, winner, share_of(base, winner, noise), shares))
    return sorted(found, key=lambda item: item.fit.chi_square)


def _second(item: tuple[str, float]) -> float:
    return item[1]


def _penalised(found: Fit) -> float:
    # of forms that fit alike the simpler one
    searched = sum(len(term.form.parameters) for term in found.problem.terms)
    return found.chi_square * (1.0 + 0.01 * searched)


def _refit_all(before: Fit, work: Sequence[tuple[str, Screened]], jobs: int) -> list[tuple[str, Fit]]:
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        fits = list(pool.map(lambda item: refit(before, item[1]), work))
    return [(name, found) for (name, _), found in zip(work, fits, strict=True)]


def _nothing_more(before: Fit, terms: Sequence[Term], excess: float, jobs: int) -> bool:
    present = {term.effect.name for term in before.problem.terms}
    ranked = screen(before, [term for term in terms if term.effect.name not in present], jobs=jobs)
    return ranked[0].gain * before.chi_square < SECOND_GAIN * excess


def admissible(found: Fit) -> bool:
    """Return whether the last term of a fit may be named: it does something and no strength sits at a bound."""
    term, values = found.problem.terms[-1], found.term_values[-1]
    for item in term.form.parameters:
        if item.role in ("strength", "amplitude") and len(term.form.amplitudes) <= 1 and item.name in found.at_bound:
            return False
    return any(values[item.name] != 0.0 for item in term.form.parameters if item.role != "shape")


def forward_selection(
    base: Fit,
    noise: float,
    terms: Sequence[Term],
    *,
    most: int = 3,
    refits: int = 8,
    second_share: float = SECOND_SHARE,
    second_gain: float = SECOND_GAIN,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Selection:
    """Add effects one after another while each recovers a fair share.

    Parameters
    ----------
    second_share
        Share of what is left that a further effect must recover; small where noise is far below any model's error.
    second_gain
        Share of what the base lacked that it must recover.
    """
    rounds: list[tuple[Candidate, ...]] = []
    chosen = base
    excess = max(base.chi_square - noise, 0.0)
    if excess <= NOTHING_MISSING * noise or most == 0:
        return Selection(base, noise, (), base)
    while len(rounds) < most:
        if rounds and chosen.chi_square - noise < FURTHER * excess and _nothing_more(chosen, terms, excess, jobs):
            break
        found = candidates_after(chosen, base, noise, terms, refits=refits, jobs=jobs, progress=progress)
        rounds.append(tuple(found))
        able = [item for item in found if admissible(item.fit)]
        if not able:
            break
        best = able[0]
        gain = chosen.chi_square - best.fit.chi_square
        left = chosen.chi_square - noise
        if len(rounds) > 1 and (gain < second_gain * excess or gain < second_share * left):
            break
        chosen = best.fit
        if chosen.chi_square - noise < max(NOTHING_MISSING * noise, SECOND_GAIN * excess):
            break
    return Selection(base, noise, tuple(rounds), chosen)
