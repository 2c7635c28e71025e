"""Further effects in storeys on which the effects chosen before do not act.

Each storey has its own equation of motion, and all motions in it are measured. The wrong form of an effect therefore
leaves a residual only in the storeys on which its force acts. What remains in another storey has another cause, even
if it is small compared with what the first effect explains. Such a storey is searched alone, and a further effect is
accepted under four conditions: it explains most of what the storey lacks beyond all forms of the effects before it;
also beyond linear frames that differ from test to test, because a change of the structure or a faulty sensor is not an
effect; it lowers the error of the storey on tests that are left out; and no other effect does so almost as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.candidates import Fitted, Placed
from mrpipe.tracing.structure.fit import Design, design_of, solve
from mrpipe.tracing.structure.flexible import gain_beyond, projected_variants
from mrpipe.tracing.structure.groups import Groups
from mrpipe.tracing.structure.left_out import Folds, gain_between
from mrpipe.tracing.structure.naming import acting_on, by_effect
from mrpipe.tracing.structure.rounds import FrameCandidate, FrameSelection, projected, round_of


def with_effects_elsewhere(
    selection: FrameSelection,
    forms: Sequence[Placed],
    folds: Folds | None,
    naming: NamingRules,
    *,
    most: int,
    rng: np.random.Generator,
    draws: int,
    jobs: int,
) -> FrameSelection:
    """Return a selection with the further effects that act on other storeys than those that were chosen.

    Parameters
    ----------
    selection
        Linear frame of any stiffness, and the chosen effects.
    forms
        Forms of all effects at their places.
    folds
        Training records that are left out in turn; None: nothing is searched.
    naming
        Rules for naming an effect.
    most
        Largest number of effects that are not declared.
    rng
        Source of randomness.
    draws
        Number of draws of the bootstrap.
    jobs
        Processes.
    """
    if folds is None or len(selection.chosen) <= selection.declared:
        return selection
    if selection.share(selection.residual) < naming.least_share:
        # the effects so far are not named, so that no residual can be attributed to further ones
        return selection
    search = _Search(forms, folds, naming, rng, draws, jobs)
    while len(selection.chosen) - selection.declared < most:
        found = search.further(selection)
        if found is None:
            break
        selection = found
    return selection


@dataclass(frozen=True)
class _Search:
    """Search of one further effect.

    Attributes
    ----------
    forms
        Forms of all effects at their places.
    folds
        Training records that are left out in turn.
    naming
        Rules for naming an effect.
    rng
        Source of randomness.
    draws
        Number of draws of the bootstrap.
    jobs
        Processes.
    """

    forms: Sequence[Placed]
    folds: Folds
    naming: NamingRules
    rng: np.random.Generator
    draws: int
    jobs: int

    def further(self, selection: FrameSelection) -> FrameSelection | None:
        """Return the selection with one further effect; None if there is none."""
        design, about = selection.design, selection.about
        free = _free_storeys(selection)
        if not selection.groups.of_storeys(free).material(selection.residual):
            return None
        columns = projected_variants(selection.chosen, design, about)
        beyond = solve(design, columns).residual
        lacking = [storey for storey in free if selection.groups.of_storeys([storey]).material(beyond)]
        for storey in sorted(lacking, key=lambda item: -selection.groups.of_storeys([item]).excess(beyond)):
            candidates = self._candidates(selection, beyond, storey)
            if candidates and self._needed(selection, columns, candidates, storey):
                return _with(selection, candidates)
        return None

    def _candidates(self, selection: FrameSelection, beyond: FloatArray, storey: int) -> tuple[FrameCandidate, ...]:
        """Return the effects that explain what a storey lacks, best first, as left-out records rank them."""
        design = replace(selection.design, residual=beyond)
        alone = replace(
            selection, design=design, groups=selection.groups.of_storeys([storey]), chosen=(), rounds=(),
            amplitudes=np.zeros(0), residual=np.zeros(0),
        )  # fmt: skip
        present = {item.name for item in selection.chosen}
        forms = [
            replace(item, storeys=(storey + 1,)) if item.effect.acts_on == "storey" else item
            for item in self.forms
            if item.effect.name not in present and item.effect.acts_on != "base" and not 0 < item.floor <= storey
        ]
        found = round_of(alone, forms, alone.about, self.jobs)
        if not found or found[0].share < selection.rules.second_share:
            return ()
        alike = [item for item in found if item.share > (1.0 - self.naming.lead) * found[0].share]
        errors = [self.folds.errors((*selection.chosen, item.outcome.fitted), storey).sum() for item in alike]
        gain = max(float(self.folds.errors(selection.chosen, storey).sum() - min(errors)), 1e-300)
        lost = [float(np.clip((error - min(errors)) / gain, 0.0, 1.0)) for error in errors]
        ranked = [replace(item, behind=value) for item, value in zip(alike, lost, strict=True)]
        others = [replace(item, behind=found[0].share - item.share) for item in found if item not in alike]
        return (*sorted(ranked, key=lambda item: item.behind), *others)

    def _needed(
        self, selection: FrameSelection, columns: FloatArray, candidates: Sequence[FrameCandidate], storey: int
    ) -> bool:
        best = candidates[0].outcome.fitted
        if any(item.behind < self.naming.lead for item in candidates[1:]):
            return False
        groups, least, about = selection.groups.of_storeys([storey]), selection.rules.second_share, selection.about
        own = projected(selection.design, (best,), about)
        if recovered(groups, *gain_beyond(columns, own, selection.design)) < least:
            return False
        before = self.folds.errors(selection.chosen, storey)
        after = self.folds.errors((*selection.chosen, best), storey)
        if not gain_between(before, after, self.rng, self.draws).significant:
            return False
        return recovered(groups, *_within_tests(selection, best)) >= least


def _free_storeys(selection: FrameSelection) -> list[int]:
    """Return the storeys, from 0, whose residual the form of no chosen effect causes alone.

    A force on a floor acts alike on all storeys below it. It may be confused with a force of a storey if there is only
    one such storey. The rotation of a base acts on all storeys.
    """
    acting: set[int] = set()
    for item, own in by_effect(selection, selection.amplitudes):
        if item.placed.floor < 2:
            acting.update(acting_on(item, own, selection))
    return [storey for storey in range(len(selection.design.residual)) if storey not in acting]


def recovered(groups: Groups, without: FloatArray, with_it: FloatArray) -> float:
    """Return the share of the excess of a residual over the noise that a fit with an effect lacks.

    Parameters
    ----------
    groups
        The groups of lines that are judged.
    without, with_it
        Residuals, shape (n, 2 b).
    """
    excess = groups.excess(without)
    return 1.0 - groups.excess(with_it) / excess if excess > 0.0 else 0.0


def _within_tests(selection: FrameSelection, further: Fitted) -> tuple[FloatArray, FloatArray]:
    """Return the residuals without and with an effect, beyond linear frames that differ from test to test."""
    about = selection.about
    alone = [design_of(selection.base, [item]) for item in selection.design.spectra]
    columns = [projected_variants(selection.chosen, item, about) for item in alone]
    own = [projected(item, (further,), about) for item in alone]
    residual = np.concatenate([item.residual for item in alone], axis=1)
    whole: Design = replace(alone[0], residual=residual, free=sum(item.free for item in alone))
    return gain_beyond(np.concatenate(columns, axis=2), np.concatenate(own, axis=2), whole)


def _with(selection: FrameSelection, candidates: tuple[FrameCandidate, ...]) -> FrameSelection:
    chosen = (*selection.chosen, candidates[0].outcome.fitted)
    solved = solve(selection.design, projected(selection.design, chosen, selection.about))
    return replace(
        selection, chosen=chosen, amplitudes=solved.amplitudes, residual=solved.residual,
        rounds=(*selection.rounds, candidates), elsewhere=selection.elsewhere + 1,
    )  # fmt: skip
