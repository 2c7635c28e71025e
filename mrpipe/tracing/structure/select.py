"""Choice of the linear frame and of the effects, by forward selection and cross-validation."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.rules import FrameRules
from mrpipe.tracing.structure.base import FrameProblem, ladder
from mrpipe.tracing.structure.candidates import Fitted, Outcome, Placed, Surroundings, columns_of, search
from mrpipe.tracing.structure.fit import Base, Design, design_of
from mrpipe.tracing.structure.groups import LINES_OF_A_GROUP, Groups, groups_of
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.spectra import Spectra

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
    """

    outcome: Outcome
    share: float
    forms: dict[str, float]

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.outcome.fitted.name


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

    @property
    def about(self) -> Surroundings:
        """Data that a search needs in addition to the records."""
        return Surroundings(self.storey_stiffness, self.rules)

    @property
    def structured(self) -> bool:
        """Whether the residual exceeds the noise by an amount that matters."""
        return self.groups.material(self.design.residual)

    def share(self, residual: FloatArray) -> float:
        """Return the share of the excess over the noise that a fit explains."""
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


def _round(
    selection: FrameSelection, forms: Sequence[Placed], about: Surroundings, jobs: int
) -> tuple[FrameCandidate, ...]:
    """Screen all forms at their starts, then search those of the best families."""
    design, rules = selection.design, selection.rules
    before = _projected(design, selection.chosen, about)
    present = {item.name for item in selection.chosen}
    able = [item for item in forms if item.effect.name not in present]
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        screened = list(pool.map(lambda item: search(item, design, before, about, screen_only=True), able))
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


def _projected(design: Design, chosen: Sequence[Fitted], about: Surroundings) -> FloatArray | None:
    if not chosen:
        return None
    return np.concatenate(
        [design.project([columns_of(item, record, about) for record in design.spectra]) for item in chosen]
    )


def select(
    problem: FrameProblem,
    effects: Sequence[StructuralEffect],
    rules: NamingRules,
    *,
    most: int = 3,
    declared: Sequence[StructuralEffect] = (),
    rng: np.random.Generator,
    draws: int = 400,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> FrameSelection:
    """Choose the linear frame and add effects one after another while each recovers a sufficient share.

    Parameters
    ----------
    problem
        Spectra of the records and the shear frame fitted to them.
    effects
        The library.
    rules
        Decision thresholds.
    most
        Largest number of effects.
    declared
        Effects that the campaign declares: fitted first, part of the baseline.
    rng
        Source of randomness.
    draws
        Number of draws of the bootstrap.
    jobs
        Processes; the result does not depend on their number.
    progress
        Called with the share done and a text.
    """
    storeys, frame_rules = problem.storey_stiffness, problem.rules
    about = Surroundings(storeys, frame_rules)
    designs = ladder(problem.training)
    chi = {str(name): item.chi_square for name, item in designs.items()}
    forms = placed_forms(effects, len(problem.masses_kg))
    simple, free = (
        FrameSelection(
            name, designs[name], groups_of(designs[name], frame_rules), chi, storey_stiffness=storeys, rules=frame_rules
        )
        for name in ("shear-frame", "linear-frame")
    )
    progress(0.3, "linear frames")
    if not simple.structured and not declared:
        return simple
    rocking = _rocking(simple, free, forms, about, rules, jobs)
    if rocking is not None:
        return replace(rocking, gains=_gains(rocking, problem, rocking.about, rng, draws))
    if declared:
        free = _with_declared(free, declared, len(problem.masses_kg), about, jobs)
    if most == 0 or not free.structured:
        return free
    found = _forward(free, forms, about, most, jobs, progress)
    return replace(found, gains=_gains(found, problem, about, rng, draws)) if found.chosen else found


def _with_declared(
    selection: FrameSelection, declared: Sequence[StructuralEffect], floors: int, about: Surroundings, jobs: int
) -> FrameSelection:
    for effect in declared:
        found = _round(selection, placed_forms([effect], floors), about, jobs)
        if found:
            selection = _taken(selection, found[0])
    return replace(selection, declared=len(selection.chosen))


def _taken(selection: FrameSelection, best: FrameCandidate) -> FrameSelection:
    solved = best.outcome.solved
    return replace(
        selection,
        chosen=(*selection.chosen, best.outcome.fitted),
        amplitudes=solved.amplitudes,
        residual=solved.residual,
    )


def _rocking(
    simple: FrameSelection,
    free: FrameSelection,
    forms: Sequence[Placed],
    about: Surroundings,
    rules: NamingRules,
    jobs: int,
) -> FrameSelection | None:
    """Return the shear frame on a rocking base, if it is as good as a general linear frame; else None.

    A rocking base without inertia is a linear frame whose stiffness is not tri-diagonal. It can therefore be detected
    only by comparison with a shear frame, and only if no other coupling is needed.
    """
    base_forms = [item for item in forms if item.effect.acts_on == "base"]
    if not base_forms:
        return None
    # share of the same groups that a general linear frame explains, which has many more parameters
    reachable = simple.share(free.design.residual)
    # a rocking base is visible at one of the start values already; otherwise skip the search
    screened = [search(item, simple.design, None, about, screen_only=True) for item in base_forms]
    if max(simple.share(item.solved.residual) for item in screened) < 0.5 * rules.least_share:
        return None
    found = _round(simple, base_forms, about, jobs)
    if not found or found[0].share < rules.least_share:
        return None
    # the stiffness of the storeys follows once the rotation of the base is subtracted from their drift
    model = model_of(simple.design, (found[0].outcome.fitted,), about)
    own = np.array([-numbers[0] for numbers in model.linear])
    if np.all(own > 0.0):
        about = Surroundings(own, simple.rules)
        found = _round(simple, base_forms, about, jobs) or found
    proven = found[0].share >= max(rules.named_share, reachable - simple.rules.rocking_lead)
    # a base with an edge that lifts is nonlinear: with few parameters it may explain more than any linear frame
    ahead = found[0].share >= max(simple.rules.rocking_share, reachable + simple.rules.rocking_lead)
    if not proven and not ahead:
        return None
    return _taken(replace(simple, rounds=(found,), storey_stiffness=about.storey_stiffness), found[0])


def _forward(
    selection: FrameSelection, forms: Sequence[Placed], about: Surroundings, most: int, jobs: int, progress: Progress
) -> FrameSelection:
    rounds: list[tuple[FrameCandidate, ...]] = []
    rules = selection.rules
    while len(rounds) < most:
        left = 1.0 - (selection.share(selection.residual) if selection.chosen else 0.0)
        if left < rules.second_gain:
            break
        found = _round(selection, forms, about, jobs)
        rounds.append(found)
        progress(0.4 + 0.1 * len(rounds), f"round {len(rounds)}")
        if not found:
            break
        gain = found[0].share - (1.0 - left)
        if gain < rules.second_gain or (len(rounds) > 1 and gain < rules.second_share * left):
            break
        selection = _taken(selection, found[0])
    return replace(selection, rounds=tuple(rounds))


def _gains(
    selection: FrameSelection, problem: FrameProblem, about: Surroundings, rng: np.random.Generator, draws: int
) -> tuple[Gain, ...]:
    """Return the gain of each effect on left-out training records; shapes are kept, all amplitudes are refitted."""
    if len(problem.training) < 2:
        return ()
    folds = min(3, len(problem.training))
    paths = [selection.chosen[:k] for k in range(selection.declared, len(selection.chosen) + 1)]
    errors: list[list[FloatArray]] = [[] for _ in paths]
    for fold in range(folds):
        kept = [item for k, item in enumerate(problem.training) if k % folds != fold]
        out = [item for k, item in enumerate(problem.training) if k % folds == fold]
        design = design_of(selection.base, kept)
        for path, own in zip(paths, errors, strict=True):
            own.extend(left_out_errors(design, path, out, about))
    sums = [np.concatenate(item) for item in errors]
    found = []
    for before, after in itertools.pairwise(sums):
        chosen = rng.integers(len(before), size=(draws, len(before)))
        shares = 1.0 - after[chosen].sum(axis=1) / np.maximum(before[chosen].sum(axis=1), 1e-300)
        low, high = np.quantile(shares, [0.025, 0.975])
        found.append(Gain(float(1.0 - after.sum() / before.sum()), (float(low), float(high))))
    return tuple(found)


def left_out_errors(
    design: Design, chosen: Sequence[Fitted], records: Sequence[Spectra], about: Surroundings
) -> list[FloatArray]:
    """Return the weighted squared error of each group of lines, for records that were not used for the design."""
    model = model_of(design, chosen, about)
    errors = []
    for record in records:
        squares = np.abs((record.target - model.predict(record)) * record.weight) ** 2
        edges = np.arange(0, squares.shape[1], LINES_OF_A_GROUP)
        errors.append(np.add.reduceat(squares, edges, axis=1).ravel())
    return errors
