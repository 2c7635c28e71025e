"""One round of the selection of effects: every form at every place is screened, and the best ones are searched."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.candidates import Fitted, Outcome, Placed, Surroundings, columns_of, search
from mrpipe.tracing.structure.fit import Base, Design
from mrpipe.tracing.structure.groups import Groups

REFINED = 3
"""Numerical technique: effects whose parameters are searched in full after screening."""

MOST_FORMS = (5, 2)
"""Numerical technique: largest number of forms that are searched, of the best effect and of every other effect."""


@dataclass(frozen=True)
class FrameCandidate:
    """An effect in its best form, in addition to those chosen before.

    Attributes
    ----------
    outcome
        The form with its parameters, and the fit with it.
    share
        Share of the excess of the residual over the noise that all effects together explain [1].
    forms
        Name of the form -> share, of all forms that were tried.
    behind
        Share of the gain of the best candidate on left-out records that this candidate does not reach [1]; 0 for the
        best one.
    alike
        Whether this candidate fits the training records almost as well as the best one, so that the left-out records
        decide between them.
    undecided
        Whether neither the left-out records nor all training records show with certainty that this candidate is worse
        than the best one.
    """

    outcome: Outcome
    share: float
    forms: dict[str, float]
    behind: float = 0.0
    alike: bool = False
    undecided: bool = False

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.outcome.fitted.name


@dataclass(frozen=True)
class BelowNoise:
    """Findings on effects that are smaller than the noise of each line.

    Attributes
    ----------
    explained
        Chi-square that the best effect, and the best one in addition to it, explain.
    alike
        Names of the effects that explain almost as much as the best one, which is the first name.
    """

    explained: float
    alike: tuple[str, ...] = ()


@dataclass(frozen=True)
class FrameSelection:
    """Result of the selection on the training records.

    Attributes
    ----------
    base
        The linear frame that the residual is judged against.
    design
        The linear model of all storeys.
    groups
        Groups of lines of the residual of the base that exceed the noise.
    chi_squares
        Chi-square of every linear frame.
    rounds
        Candidates of each round of the selection.
    chosen
        Effects in the order of choice, amplitudes one after another.
    amplitudes
        Amplitudes of the chosen effects, concatenated.
    residual
        Weighted residual with the chosen effects.
    gains
        Cross-validated gain of each chosen effect.
    declared
        Number of the chosen effects that the campaign declares.
    storey_stiffness
        Stiffness of the storeys of the shear frame, shape (n,) [N/m].
    rules
        Decision thresholds.
    below_noise
        Set if no group of lines exceeds the noise, but effects that act on all lines explain something; shares then
        refer to what they explain.
    elsewhere
        Number of the chosen effects, the last ones, that act on other storeys than those before them.
    """

    base: Base
    design: Design
    groups: Groups
    chi_squares: dict[str, float]
    rounds: tuple[tuple[FrameCandidate, ...], ...] = ()
    chosen: tuple[Fitted, ...] = ()
    amplitudes: FloatArray = field(default_factory=lambda: np.zeros(0))
    residual: FloatArray = field(default_factory=lambda: np.zeros(0))
    gains: tuple[Gain, ...] = ()
    declared: int = 0
    storey_stiffness: FloatArray = field(default_factory=lambda: np.zeros(0))
    rules: FrameRules = field(default_factory=FrameRules)
    below_noise: BelowNoise | None = None
    elsewhere: int = 0

    @property
    def about(self) -> Surroundings:
        """Data that a search needs in addition to the records."""
        return Surroundings(self.storey_stiffness, self.rules)

    @property
    def structured(self) -> bool:
        """Whether the residual exceeds the noise, or contains an effect below the noise, by an amount that matters."""
        return self.below_noise is not None or self.groups.material(self.design.residual)

    @property
    def remaining(self) -> FloatArray:
        """Weighted residual with the chosen effects, or that of the linear frame without any, shape (n, 2 b)."""
        return self.residual if self.chosen else self.design.residual

    def over(self, residual: FloatArray) -> FloatArray:
        """Return what is missing in each group of lines: excess over the noise, or what an effect below it explains."""
        if self.below_noise is None:
            return self.groups.over(residual)
        lower = self.rounds[0][0].outcome.solved.residual
        before, after = (self.groups.mean_square(item) for item in (self.design.residual, lower))
        return np.asarray(np.maximum(before - after, 0.0) * self.groups.count)

    def share(self, residual: FloatArray) -> float:
        """Return the share of what is missing that a fit explains: of the excess over the noise, or of chi-square."""
        if self.below_noise is not None:
            return float(np.sum(self.design.residual**2) - np.sum(residual**2)) / self.below_noise.explained
        return 1.0 - self.groups.excess(residual) / max(self.groups.excess(self.design.residual), 1e-12)


def placed_forms(effects: Sequence[StructuralEffect], floors: int) -> list[Placed]:
    """Return every form at every possible place, for effects that act on the structure."""
    found = []
    for effect in effects:
        if effect.acts_on == "floor":
            found += [Placed(effect, form, floor) for form in effect.forms for floor in range(1, floors + 1)]
        elif effect.acts_on in ("storey", "base"):
            found += [Placed(effect, form) for form in effect.forms]
    return found


def screened_forms(selection: FrameSelection, forms: Sequence[Placed], about: Surroundings, jobs: int) -> list[Outcome]:
    """Return the best start of each form of the effects that are not chosen yet."""
    before = projected(selection.design, selection.chosen, about) if selection.chosen else None
    present = {item.name for item in selection.chosen}
    able = [item for item in forms if item.effect.name not in present]
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return list(pool.map(lambda item: search(item, selection.design, before, about, screen_only=True), able))


def round_of(
    selection: FrameSelection,
    forms: Sequence[Placed],
    about: Surroundings,
    jobs: int,
    screened: Sequence[Outcome] | None = None,
) -> tuple[FrameCandidate, ...]:
    """Screen all forms at their starts (unless `screened` contains them), then search those of the best families."""
    design, rules = selection.design, selection.rules
    before = projected(design, selection.chosen, about) if selection.chosen else None
    if screened is None:
        screened = screened_forms(selection, forms, about, jobs)
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        families: dict[str, list[Outcome]] = {}
        for item in sorted(screened, key=lambda item: item.solved.chi_square):
            families.setdefault(item.fitted.name, []).append(item)
        work: list[Placed] = []
        ranked = sorted(families.values(), key=lambda items: -selection.share(items[0].solved.residual))
        best_share = selection.share(ranked[0][0].solved.residual) if ranked else 0.0
        current = selection.share(selection.residual) if selection.chosen else 0.0
        least = rules.promising * best_share
        promising = [items for items in ranked if selection.share(items[0].solved.residual) > least]
        if selection.chosen and best_share - current < 0.5 * rules.second_gain:
            promising = []
        for place, items in enumerate(promising[:REFINED]):
            most = MOST_FORMS[min(place, 1)]
            work += [item.fitted.placed for item in _distinct(items)[:most]]
        refined = list(pool.map(lambda item: search(item, design, before, about), work))
    found = []
    for name, items in families.items():
        own = [item for item in refined if item.fitted.name == name] or items[:1]
        own = [item for item in own if admissible(item)]
        if not own:
            continue
        shares = {_label(item): selection.share(item.solved.residual) for item in [*reversed(items), *own]}
        best = min(own, key=lambda item: _penalised(item, rules.per_parameter))
        found.append(FrameCandidate(best, selection.share(best.solved.residual), shares))
    return tuple(sorted(found, key=lambda item: -item.share))


def admissible(item: Outcome) -> bool:
    """Return whether dimensionless amplitudes of the last form, such as shares, do not exceed their upper bounds."""
    form = item.fitted.placed.form
    own = item.solved.amplitudes[-len(form.amplitudes) :]
    shares = [parameter.scale == "one" for parameter in form.amplitudes]
    within = [value <= parameter.upper for value, parameter in zip(own, form.amplitudes, strict=True)]
    return all(ok or not share for ok, share in zip(within, shares, strict=True))


def _distinct(items: Sequence[Outcome]) -> list[Outcome]:
    """Return the best place of each form, best first."""
    seen: dict[str, Outcome] = {}
    for item in items:
        seen.setdefault(item.fitted.placed.form.name, item)
    return list(seen.values())


def _label(item: Outcome) -> str:
    placed = item.fitted.placed
    return f"{placed.form.name} at floor {placed.floor}" if placed.floor else placed.form.name


def _penalised(item: Outcome, per_parameter: float) -> float:
    # prefer the simpler of two forms that fit alike
    placed = item.fitted.placed.form
    return item.solved.chi_square * (1.0 + per_parameter * (len(placed.searched) + len(placed.amplitudes)))


def projected(design: Design, chosen: Sequence[Fitted], about: Surroundings) -> FloatArray:
    """Return the columns of effects, minus their projection onto the linear frame, shape (k, n, 2 b)."""
    return np.concatenate(
        [design.project([columns_of(item, record, about) for record in design.spectra]) for item in chosen]
    )


def taken(selection: FrameSelection, best: FrameCandidate) -> FrameSelection:
    """Return the selection with a further effect."""
    solved = best.outcome.solved
    return replace(
        selection,
        chosen=(*selection.chosen, best.outcome.fitted),
        amplitudes=solved.amplitudes,
        residual=solved.residual,
    )
