"""An effect whose force is smaller than the noise of each spectral line, but acts on all lines.

Groups of lines show a residual that exceeds the noise, whatever its form. A force of known form is found far below the
noise, because its projection onto the residual adds up over all lines (matched filter). Such a residual is too small
to show that the form is right. The effect is therefore named only under three conditions: no other effect of the
library imitates it, nothing significant remains for the others, and the effect is visible within single tests, because
a difference between tests may be a change of the structure or of a sensor. Only nonlinear forces are considered,
because small differences between the frequency responses of the sensors leave a linear residual, which an oscillating
base would explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import ComplexArray
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.candidates import Fitted, Placed
from mrpipe.tracing.structure.fit import Design, design_of, stacked
from mrpipe.tracing.structure.flexible import gain_beyond, is_linear, parts_of, projected_variants
from mrpipe.tracing.structure.left_out import Folds, gains_of
from mrpipe.tracing.structure.rounds import (
    BelowNoise,
    FrameCandidate,
    FrameSelection,
    round_of,
    screened_forms,
    taken,
)
from mrpipe.tracing.structure.spectra import Spectra, storey_sums

BY_SEARCH = 2.0
"""Numerical technique: a search of the parameters is worth its time if the starts reach the limit divided by this."""


@dataclass(frozen=True)
class _Judge:
    """Tests of single effects.

    Attributes
    ----------
    raw
        Linear frame without effects, in which the share of an effect is the chi-square that it explains.
    forms
        Number of forms that are tried.
    folds
        Training records that are left out in turn.
    alone
        Linear frames that are fitted to each record alone.
    masses_kg
        Floor masses, shape (n,) [kg].
    """

    raw: FrameSelection
    forms: int
    folds: Folds
    alone: tuple[Design, ...]
    masses_kg: FloatArray

    def least(self, parameters: int) -> float:
        """Return the chi-square that noise does not explain with a number of parameters, by any form."""
        rules = self.raw.rules
        limit = float(stats.chi2.isf(rules.significance / self.forms, parameters))
        # the noise of each line is an estimate; that of the noisiest storey counts
        level = float(np.max(np.mean(self.raw.design.residual**2, axis=1)))
        return rules.coloured * limit * max(1.0, level)

    def certain(self, item: FrameCandidate) -> bool:
        """Return whether an effect explains more than noise does, in all tests together and within single tests."""
        fitted = item.outcome.fitted
        least = self.least(len(fitted.placed.form.searched) + len(item.outcome.solved.amplitudes))
        return item.share > least and self._within_tests(fitted) > least

    def residuals(self, fitted: Fitted) -> tuple[FloatArray, FloatArray]:
        """Return the residuals without and with the nonlinear part of an effect, shape (n, 2 b) each."""
        design, about = self.raw.design, self.raw.about
        linear, nonlinear = parts_of(fitted, design, about)
        return gain_beyond(linear, nonlinear, design)

    def _within_tests(self, fitted: Fitted) -> float:
        """Return the chi-square that an effect explains beyond linear frames which differ from test to test."""
        parts = [parts_of(fitted, item, self.raw.about) for item in self.alone]
        linear, nonlinear = (np.concatenate([pair[k] for pair in parts], axis=2) for k in (0, 1))
        residual = np.concatenate([item.residual for item in self.alone], axis=1)
        whole = replace(self.alone[0], residual=residual, free=sum(item.free for item in self.alone))
        return gain_of(*gain_beyond(linear, nonlinear, whole))

    def matters(self, item: FrameCandidate) -> bool:
        """Return whether an effect changes the motion of a storey in some record by a share that matters.

        In each group of lines a force changes the motion by its share of the force that drives the motion. At a
        resonance this is a small part of the force of the storey, most of which stiffness and inertia balance. The
        groups count by their part of the motion.
        """
        design, groups, n = self.raw.design, self.raw.groups, len(self.raw.design.residual)
        without, with_it = self.residuals(item.outcome.fitted)
        weight = np.concatenate([np.tile(one.weight, 2) for one in design.spectra], axis=1)
        target = np.concatenate([stacked(one.target) for one in design.spectra], axis=1)
        driving = np.concatenate([stacked(self._driving(one)) for one in design.spectra], axis=1)
        force, drives, moves = (
            np.bincount(groups.index.ravel(), weights=(lines**2).ravel())
            for lines in ((without - with_it) / weight, driving, target)
        )
        place = groups.record * n + groups.storey
        changed = np.bincount(place, weights=moves * force / np.maximum(np.minimum(drives, moves), 1e-300))
        share = np.sqrt(changed / np.maximum(np.bincount(place, weights=moves), 1e-300))
        return bool(np.any(share > self.raw.rules.of_response))

    def _driving(self, spectra: Spectra) -> ComplexArray:
        """Return the force that the ground exerts on each storey, or its own force if not the ground alone drives it.

        It has the shape of the target of the spectra [N/sqrt(Hz)].
        """
        if spectra.record.kind not in ("sweep", "random") or spectra.record.carries_device:
            return spectra.target
        above = storey_sums(spectra.record.floors) @ self.masses_kg
        return spectra.in_equations(above[:, None] * spectra.lines_of(spectra.motion.ground))

    def further(self, first: FrameCandidate, others: Sequence[Fitted]) -> float:
        """Return the chi-square that another effect explains beyond all forms of the first one; 0 if it is noise."""
        design, about = self.raw.design, self.raw.about
        columns = projected_variants([first.outcome.fitted], design, about)
        found = [0.0]
        for item in others:
            linear, nonlinear = parts_of(item, design, about)
            gain = gain_of(*gain_beyond(np.concatenate([columns, linear]), nonlinear, design))
            found.append(gain if gain > self.least(len(item.numbers) + len(nonlinear)) else 0.0)
        return max(found)


def gain_of(without: FloatArray, with_it: FloatArray) -> float:
    """Return the chi-square that a residual `with_it` an effect lacks, compared with one `without` it."""
    return float(np.sum(without**2) - np.sum(with_it**2))


def with_effect_below_noise(
    free: FrameSelection,
    forms: Sequence[Placed],
    folds: Folds | None,
    naming: NamingRules,
    masses: FloatArray,
    *,
    rng: np.random.Generator,
    draws: int,
    jobs: int,
) -> FrameSelection:
    """Return a selection whose residual is noise, with an effect if one is certain in spite of the noise.

    Parameters
    ----------
    free
        Linear frame of any stiffness, without effects; no group of lines exceeds the noise by an amount that matters.
    forms
        Forms of all effects at their places.
    folds
        Training records that are left out in turn; None: nothing is searched.
    naming
        Rules for naming an effect.
    masses
        Floor masses, shape (n,) [kg].
    rng
        Source of randomness.
    draws
        Number of draws of the bootstrap.
    jobs
        Processes.
    """
    able = [item for item in forms if not is_linear(item, free.design, free.about)]
    if folds is None or not able:
        return free
    raw = replace(free, below_noise=BelowNoise(1.0))
    alone = tuple(design_of(free.base, [item]) for item in free.design.spectra)
    judge = _Judge(raw, len(able), folds, alone, masses)
    screened = screened_forms(raw, able, raw.about, jobs)
    if BY_SEARCH * max(raw.share(item.solved.residual) for item in screened) < judge.least(1):
        return free
    tried = round_of(raw, able, raw.about, jobs, screened)
    gains = [gain_of(*judge.residuals(item.outcome.fitted)) for item in tried]
    every = sorted(
        (replace(item, share=gain) for item, gain in zip(tried, gains, strict=True)), key=lambda item: -item.share
    )
    found = [item for item in every if judge.certain(item)]
    found = [item for item in found if gains_of(folds, (item.outcome.fitted,), 0, rng, draws)[0].significant]
    if not found or not judge.matters(found[0]):
        return free
    ranked = _ranked(found, folds)
    alike = tuple(item.name for item in ranked if item.behind < naming.lead)
    others = [item.outcome.fitted for item in every if item.name != ranked[0].name]
    explained = ranked[0].share + judge.further(ranked[0], others)
    rivals = [item for item in every if item.name not in {other.name for other in ranked}]
    behind = [replace(item, behind=1.0 - item.share / ranked[0].share) for item in rivals]
    listed = tuple(replace(item, share=item.share / explained) for item in (*ranked, *behind))
    selection = replace(free, below_noise=BelowNoise(explained, alike), rounds=(listed,))
    if len(alike) > 1 or listed[0].share < naming.named_share:
        return selection
    selection = taken(selection, listed[0])
    return replace(selection, gains=gains_of(folds, selection.chosen, 0, rng, draws))


def _ranked(found: Sequence[FrameCandidate], folds: Folds) -> list[FrameCandidate]:
    """Return candidates, the one with the largest gain first, with the share of this gain that each does not reach.

    The gain on the training records and that on left-out records count alike: the better of two candidates must be
    better in both.
    """
    errors = [folds.error((item.outcome.fitted,)) for item in found]
    gain = max(folds.error(()) - min(errors), 1e-300)
    lost = [
        (1.0 - item.share / found[0].share, (error - min(errors)) / gain)
        for item, error in zip(found, errors, strict=True)
    ]
    first = min(range(len(found)), key=lambda place: sum(lost[place]))
    behind = [min(a - lost[first][0], b - lost[first][1]) for a, b in lost]
    behind[first] = 0.0
    return sorted(
        (replace(item, behind=max(value, 0.0)) for item, value in zip(found, behind, strict=True)),
        key=lambda item: item.behind,
    )
