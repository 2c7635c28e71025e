"""Choice of the linear frame and of the effects, by forward selection and cross-validation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.effects.structural.contract import StructuralEffect
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.base import FrameProblem, ladder
from mrpipe.tracing.structure.below_noise import with_effect_below_noise
from mrpipe.tracing.structure.candidates import Fitted, Placed, Surroundings
from mrpipe.tracing.structure.elsewhere import with_effects_elsewhere
from mrpipe.tracing.structure.fit import solve
from mrpipe.tracing.structure.flexible import gain_beyond, projected_variants
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.left_out import Folds, folds_of, gains_of
from mrpipe.tracing.structure.rocking import on_rocking_base
from mrpipe.tracing.structure.rounds import FrameCandidate, FrameSelection, placed_forms, projected, round_of, taken


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
        found = _below_noise(free, problem, forms, rules, most, rng, draws, jobs)
        return simple if found.below_noise is None else found
    rocking = on_rocking_base(simple, free, forms, jobs, rules.least_share)
    if rocking is not None and not free.structured:
        folds = folds_of(rocking.base, problem.training, rocking.about)
        return replace(rocking, gains=gains_of(folds, rocking.chosen, 0, rng, draws))
    if declared:
        free = _with_declared(free, declared, len(problem.masses_kg), about, jobs)
    if most == 0 or not free.structured:
        return free if declared else _below_noise(free, problem, forms, rules, most, rng, draws, jobs)
    folds = folds_of(free.base, problem.training, about)
    found = needed_only(_forward(free, forms, folds, most, jobs, progress, rules), folds)
    if rocking is not None:
        found, folds = _better(found, folds, rocking, folds_of(rocking.base, problem.training, rocking.about))
    if not found.chosen:
        return found
    found = replace(found, gains=gains_of(folds, found.chosen, found.declared, rng, draws))
    more = with_effects_elsewhere(found, forms, folds, rules, most=most, rng=rng, draws=draws, jobs=jobs)
    return replace(more, gains=gains_of(folds, more.chosen, more.declared, rng, draws)) if more.elsewhere else found


def _below_noise(
    free: FrameSelection,
    problem: FrameProblem,
    forms: Sequence[Placed],
    rules: NamingRules,
    most: int,
    rng: np.random.Generator,
    draws: int,
    jobs: int,
) -> FrameSelection:
    if most == 0:
        return free
    folds = folds_of(free.base, problem.training, free.about)
    return with_effect_below_noise(free, forms, folds, rules, problem.masses_kg, rng=rng, draws=draws, jobs=jobs)


def _better(
    found: FrameSelection, folds: Folds | None, rocking: FrameSelection, folds_rocking: Folds | None
) -> tuple[FrameSelection, Folds | None]:
    """Return the selection with the smaller error on left-out records: effects on any linear frame, or a rocking base.

    A base whose edge lifts is nonlinear, as other effects are, and each of them may imitate another one.
    """
    if folds is None or folds_rocking is None:
        errors = [_mean_square(found), _mean_square(rocking)]
    else:
        errors = [folds.error(found.chosen), folds_rocking.error(rocking.chosen)]
    return (rocking, folds_rocking) if errors[1] <= errors[0] else (found, folds)


def _mean_square(selection: FrameSelection) -> float:
    return float(np.mean(selection.remaining**2))


def _with_declared(
    selection: FrameSelection, declared: Sequence[StructuralEffect], floors: int, about: Surroundings, jobs: int
) -> FrameSelection:
    for effect in declared:
        found = round_of(selection, placed_forms([effect], floors), about, jobs)
        if found:
            selection = taken(selection, found[0])
    return replace(selection, declared=len(selection.chosen))


def _forward(
    selection: FrameSelection,
    forms: Sequence[Placed],
    folds: Folds | None,
    most: int,
    jobs: int,
    progress: Progress,
    naming: NamingRules,
) -> FrameSelection:
    """Add effects until the cause counts as proven: what is missing then is the form of an effect."""
    rounds: list[tuple[FrameCandidate, ...]] = []
    rules, about = selection.rules, selection.about
    while len(rounds) < most:
        left = 1.0 - (selection.share(selection.residual) if selection.chosen else 0.0)
        if left < 1.0 - naming.named_share:
            break
        found = by_left_out_error(round_of(selection, forms, about, jobs), selection, folds, naming.lead)
        rounds.append(found)
        progress(0.4 + 0.1 * len(rounds), f"round {len(rounds)}")
        if not found:
            break
        gain = found[0].share - (1.0 - left)
        if gain < rules.second_gain or (len(rounds) > 1 and gain < rules.second_share * left):
            break
        if selection.chosen and not beyond_forms(selection, found[0]):
            break
        selection = taken(selection, found[0])
    return replace(selection, rounds=tuple(rounds))


def beyond_forms(selection: FrameSelection, further: FrameCandidate) -> bool:
    """Return whether a further effect is needed if the chosen ones may combine all their forms.

    No form of the library is exactly that of the structure. What an effect leaves where it acts is the error of its
    form, and another effect can correct it. An effect of another cause also explains something beyond all these forms.

    Parameters
    ----------
    selection
        The chosen effects.
    further
        The further effect.
    """
    columns = projected_variants(selection.chosen, selection.design, selection.about)
    own = projected(selection.design, (further.outcome.fitted,), selection.about)
    without, with_it = gain_beyond(columns, own, selection.design)
    return selection.share(with_it) - selection.share(without) >= selection.rules.second_gain


def by_left_out_error(
    candidates: Sequence[FrameCandidate], selection: FrameSelection, folds: Folds | None, lead: float
) -> tuple[FrameCandidate, ...]:
    """Return candidates best first, with the share that each is behind the best.

    The order is that of the shares on the training records. Errors on left-out records decide between candidates that
    fit almost alike.

    Parameters
    ----------
    candidates
        Candidates of one round, best first on the training records.
    selection
        Effects that were chosen before.
    folds
        Records that are left out in turn; None if there is only one.
    lead
        Candidates fit alike if what they leave exceeds what the best one leaves by this share of it, and by what a
        further effect must recover.
    """
    if not candidates:
        return ()
    best = candidates[0].share
    found = [replace(item, behind=best - item.share) for item in candidates]
    alike = [item for item in found if item.behind <= lead * max(1.0 - best, 0.0) + selection.rules.second_gain]
    if folds is None or len(alike) < 2:
        return tuple(found)
    errors = [folds.error((*selection.chosen, item.outcome.fitted)) for item in alike]
    gain = max(folds.error(selection.chosen) - min(errors), 1e-300)
    alike = [
        replace(item, behind=float(np.clip((error - min(errors)) / gain, 0.0, 1.0)))
        for item, error in zip(alike, errors, strict=True)
    ]
    return (*sorted(alike, key=lambda item: item.behind), *found[len(alike) :])


def needed_only(selection: FrameSelection, folds: Folds | None) -> FrameSelection:
    """Return a selection without effects that the effects chosen after them make superfluous.

    An effect that was chosen first may only have imitated one that was chosen later. It is needed if the error on
    left-out records rises without it by at least the share that a further effect must recover.

    Parameters
    ----------
    selection
        The chosen effects.
    folds
        Records that are left out in turn; None if there is only one.
    """
    first, count = selection.declared, len(selection.chosen)
    if folds is None or count - first < 2:
        return selection
    whole = folds.error(selection.chosen)
    least = selection.rules.second_gain * max(folds.error(selection.chosen[:first]) - whole, 0.0)
    losses = {place: folds.error(_without(selection, place)) - whole for place in range(first, count)}
    place = min(losses, key=lambda item: losses[item])
    if losses[place] >= least:
        return selection
    kept = _without(selection, place)
    solved = solve(selection.design, projected(selection.design, kept, selection.about))
    shorter = replace(
        selection, chosen=kept, amplitudes=solved.amplitudes, residual=solved.residual, rounds=_rounds(selection, place)
    )
    return needed_only(shorter, folds)


def _without(selection: FrameSelection, place: int) -> tuple[Fitted, ...]:
    return (*selection.chosen[:place], *selection.chosen[place + 1 :])


def _rounds(selection: FrameSelection, place: int) -> tuple[tuple[FrameCandidate, ...], ...]:
    """Return the rounds without that of an effect; its rivals remain those of the effect that was chosen after it."""
    index = place - selection.declared
    before, after = selection.rounds[: index + 1], selection.rounds[index + 1 :]
    if place + 1 == len(selection.chosen):
        return (*before[:-1], *after)
    following = selection.chosen[place + 1].name
    first = [item for item in before[-1] if item.name == following] or [after[0][0]]
    others = [item for item in before[-1] if item.name != following]
    return (*before[:-1], (*first, *others), *after[1:])
