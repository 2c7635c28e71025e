"""Choice of the linear frame and of the effects, by forward selection and cross-validation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
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
    designs = ladder(problem.judged)
    chi = {str(name): item.chi_square for name, item in designs.items()}
    # without a shear frame to compare with, the rotation of the base cannot be separated from a linear frame
    able = [item for item in effects if problem.modal is None or item.acts_on != "base"]
    forms = placed_forms(able, len(problem.masses_kg))
    simple, free = (
        FrameSelection(item.base, item, groups_of(item, frame_rules), chi, storey_stiffness=storeys, rules=frame_rules)
        for item in designs.values()
    )
    progress(0.3, "linear frames")
    if not simple.structured and not declared:
        found = _below_noise(free, problem, forms, rules, most, rng, draws, jobs)
        return simple if found.below_noise is None else found
    # a shear frame moves in all its modes
    rocking = None if problem.modal else on_rocking_base(simple, free, forms, jobs, rules.least_share)
    if rocking is not None and not free.structured:
        folds = folds_of(rocking.base, problem.judged, rocking.about)
        return replace(rocking, gains=gains_of(folds, rocking.chosen, 0, rng, draws))
    if declared:
        free = _with_declared(free, declared, len(problem.masses_kg), about, jobs)
    if most == 0 or not free.structured:
        return free if declared else _below_noise(free, problem, forms, rules, most, rng, draws, jobs)
    folds = folds_of(free.base, problem.judged, about)
    found = needed_only(_forward(free, forms, folds, most, jobs, progress, rules), folds)
    if rocking is not None:
        found, folds = _better(found, folds, rocking, folds_of(rocking.base, problem.judged, rocking.about))
    if not found.chosen:
        return found
    found = replace(found, gains=gains_of(folds, found.chosen, found.declared, rng, draws))
    if problem.modal:
        # each of these equations contains the forces of all storeys, so that nothing shows where a further effect acts
        return found
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
    # modes that are left out leave a residual below the noise of each line, which no effect causes
    if most == 0 or problem.modal:
        return free
    folds = folds_of(free.base, problem.judged, free.about)
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
    """Return candidates, best first, with the share of the gain of the best one that each does not reach.

    The order is that of the shares on the training records. Errors on left-out records decide between candidates that
    fit almost equally well.

    Parameters
    ----------
    candidates
        Candidates of one round, best first on the training records.
    selection
        Effects that were chosen before.
    folds
        Records that are left out in turn; None if there is only one.
    lead
        Candidates fit almost equally well if their residual exceeds that of the best candidate by at most this share of
        it plus the share of the whole residual that a further effect must recover.
    """
    if not candidates:
        return ()
    best = candidates[0].share
    found = [replace(item, behind=best - item.share) for item in candidates]
    alike = [item for item in found if item.behind <= lead * max(1.0 - best, 0.0) + selection.rules.second_gain]
    others = found[len(alike) :]
    if len(alike) < 2:
        return tuple(found)
    if folds is None:
        return (*_decided(alike, [np.zeros(0)] * len(alike), selection), *others)
    errors = [folds.errors((*selection.chosen, item.outcome.fitted)) for item in alike]
    least = min(float(item.sum()) for item in errors)
    gain = max(folds.error(selection.chosen) - least, 1e-300)
    ranked = sorted(zip(alike, errors, strict=True), key=lambda pair: float(pair[1].sum()))
    alike = [replace(item, behind=float(np.clip((error.sum() - least) / gain, 0.0, 1.0))) for item, error in ranked]
    return (*_decided(alike, [error for _, error in ranked], selection), *others)


def _decided(
    alike: Sequence[FrameCandidate], left_out: Sequence[FloatArray], selection: FrameSelection
) -> tuple[FrameCandidate, ...]:
    """Return candidates that fit almost equally well, best first; each says whether it may be as good as the best.

    Left-out records alone cannot separate all effects: the record with the largest drift, which shows a bumper best,
    is never left out. An effect is therefore also separated by the errors on all training records.
    """
    index, limit = selection.groups.index.ravel(), selection.rules.lead_errors
    fitted = [
        np.asarray(np.bincount(index, weights=item.outcome.solved.residual.ravel() ** 2), dtype=np.float64)
        for item in alike
    ]
    undecided = [
        not certainly_positive(error - left_out[0], limit) and not certainly_positive(own - fitted[0], limit)
        for error, own in zip(left_out, fitted, strict=True)
    ]
    return tuple(
        replace(item, alike=True, undecided=place > 0 and undecided[place]) for place, item in enumerate(alike)
    )


def certainly_positive(differences: FloatArray, errors: float) -> bool:
    """Return whether the mean of some numbers exceeds its standard error by a factor.

    For the differences of the squared errors of two models this is the test of Vuong (Econometrica 57, 1989, p. 307),
    which compares models that do not contain each other.

    Parameters
    ----------
    differences
        Independent numbers, shape (g,).
    errors
        The factor.
    """
    if len(differences) < 2:
        return False
    return bool(np.mean(differences) > errors * np.std(differences, ddof=1) / np.sqrt(len(differences)))


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
