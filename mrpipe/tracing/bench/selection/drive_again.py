"""Second choice of the laws of the drive, after base form and effects are known."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from mrpipe.dampers.laws import LARGEST_ORDER, for_blocks
from mrpipe.fitting.drive_cells import Cells, cells_of
from mrpipe.fitting.drive_laws import VISCOSITY_LAWS, YIELD_LAWS, adequate_laws, fit_laws, judge
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Base
from mrpipe.fitting.reference import with_own_laws
from mrpipe.fitting.start import distinct_levels, polynomial_laws
from mrpipe.tracing.bench.selection.select import Selection

FORMS_WITH_LAWS_AGAIN = 6
"""Numerical technique: largest number of base forms whose laws are chosen again before effects are searched."""

COMPARABLE = 5.0
"""Numerical technique: largest chi-square of these forms, as a multiple of that of the best form."""


def with_laws_again(selection: Selection, yield_order: int, viscosity_order: int) -> Selection:
    """Return the selection with laws of the drive that are chosen for its base form and effects.

    The baseline has the simplest laws with which the fit is as good as with any other. A missing effect can hide the
    true law, so the laws are chosen again with the chosen model. New laws are taken if the fit improves by a
    significant share of the noise.

    Parameters
    ----------
    selection
        Chosen model.
    yield_order, viscosity_order
        Largest degrees of the polynomials that are tried.
    """
    chosen = selection.chosen
    if chosen is selection.base:
        return selection
    found = with_adequate_laws(chosen, yield_order, viscosity_order)
    if found.chi_square >= chosen.chi_square - selection.nothing_missing * selection.noise:
        return selection
    return _with_chosen(selection, found)


def with_adequate_laws(found: Fit, yield_order: int, viscosity_order: int) -> Fit:
    """Return the fit with the simplest laws of the drive that fit as well as those with the most coefficients.

    Parameters
    ----------
    found
        Fit with or without effects.
    yield_order, viscosity_order
        Largest degrees of the polynomials that are tried.
    """
    richest = _with_polynomials(found, yield_order, viscosity_order)
    if found.problem.base.laws == richest.laws:
        return found
    rich = _with_laws(found, richest)
    return _with_laws(rich, replace(richest, laws=adequate_laws(rich)))


def with_laws_of_leaders(
    singles: Mapping[str, Fit], yield_order: int, viscosity_order: int, *, enough: float, least: float, jobs: int = 1
) -> dict[str, Fit]:
    """Return base forms without effects, the best of them with laws of the drive that are adequate for the form itself.

    The forms were fitted with the laws of the declared form. A poor declared form hides how the viscosity or the yield
    force depends on the drive, and an effect would then get the name of this dependence.

    Parameters
    ----------
    singles
        Name -> fit to the draft, all with the laws of the declared form.
    yield_order, viscosity_order
        Largest degrees of the polynomials that are tried.
    enough
        Chi-square that no form has to fall below. If one form does, all forms are returned as they are.
    least
        Least decrease of the chi-square for which a form takes other laws.
    jobs
        Threads.
    """
    best = min(item.chi_square for item in singles.values())
    if best <= enough:
        return dict(singles)
    ordered = sorted(singles, key=lambda name: singles[name].chi_square)[:FORMS_WITH_LAWS_AGAIN]
    names = [name for name in ordered if singles[name].chi_square <= COMPARABLE * best]

    def again(name: str) -> Fit:
        found = with_adequate_laws(singles[name], yield_order, viscosity_order)
        return found if found.chi_square < singles[name].chi_square - least else singles[name]

    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return {**singles, **dict(zip(names, pool.map(again, names), strict=True))}


def _with_polynomials(found: Fit, yield_order: int, viscosity_order: int) -> Base:
    """Return the base of a fit with polynomials of these degrees, or of those that the levels of drive determine."""
    base, levels = found.problem.base, distinct_levels(found.problem.recordings)
    return replace(base, laws=polynomial_laws(base.form, levels, yield_order, viscosity_order))


def _with_laws(found: Fit, base: Base) -> Fit:
    problem = replace(found.problem, base=base)
    return with_own_laws(fit(problem, start_of(problem, found.base_values, found.term_values), iterations=12))


def with_final_laws(selection: Selection, least_gain: float) -> Selection:
    """Return the selection with the laws of the drive that predict best, of any kind.

    While effects are searched, the laws are polynomials of low degree, because a flexible or saturating law would hide
    an effect that changes the drive. This reason no longer applies once the names are final. Other laws replace the
    present ones if the fit improves by a significant share of the noise, and if they predict inner levels of drive left
    out of their fit at least as well.

    Parameters
    ----------
    selection
        Chosen model with its final names.
    least_gain
        Least share by which other laws must lower the squared residual.
    """
    chosen = selection.chosen
    least = selection.nothing_missing * selection.noise
    if chosen.chi_square <= selection.noise + least:
        return selection
    least = max(least, least_gain * chosen.chi_square)
    rich, cells = _richest(chosen)
    fits = [rich, *_with_best_laws(rich, cells, selection.noise)]
    best = min(fits, key=lambda item: _information(item, selection.noise))
    if best.chi_square > chosen.chi_square - least or not _predicts_levels(cells, best, chosen):
        return selection
    return _with_chosen(selection, best)


def _with_chosen(selection: Selection, found: Fit) -> Selection:
    """Return the selection with another fit instead of the chosen one, also if no effect was chosen."""
    if selection.chosen is selection.without_effects:
        return replace(selection, chosen=found, ground=found)
    return replace(selection, chosen=found)


def _predicts_levels(cells: Cells, found: Fit, other: Fit) -> bool:
    """Return whether the laws of a fit predict inner levels left out at least as well as those of another fit."""
    own, rival = (judge(cells, (item.problem.base.laws[0], item.problem.base.laws[1])) for item in (found, other))
    if not len(own.left_out):
        return False
    return not len(rival.left_out) or float(np.mean(own.left_out)) <= float(np.mean(rival.left_out))


def _richest(found: Fit) -> tuple[Fit, Cells]:
    """Return the fit with the polynomials of highest degree that the levels determine, and its sums over the cells."""
    rich = _with_laws(found, _with_polynomials(found, LARGEST_ORDER, max(law.order for law in VISCOSITY_LAWS)))
    return rich, cells_of(rich)


def _with_best_laws(rich: Fit, cells: Cells, noise: float) -> Iterator[Fit]:
    """Yield the fit with the laws whose information criterion, from the sums over the cells, is least, if any exist."""
    base = rich.problem.base
    bends = any(term.effect.law_of_drive for term in rich.problem.terms)
    pairs = [
        pair
        for pair in itertools.product(YIELD_LAWS, VISCOSITY_LAWS)
        if max(law.numbers for law in pair) < cells.levels and not (bends and any(law.saturates for law in pair))
    ]
    if pairs:
        cost = _price(rich, noise)
        laws = min(
            pairs, key=lambda pair: float(np.sum(fit_laws(cells, pair)[0])) + cost * sum(law.numbers for law in pair)
        )
        yield _with_laws(rich, replace(base, laws=for_blocks(laws, len(base.laws))))


def _information(found: Fit, noise: float) -> float:
    """Return the weighted sum of squares of a fit plus the penalty for the coefficients of its laws."""
    samples = np.count_nonzero(found.problem.root_weight)
    return found.chi_square * samples + _price(found, noise) * sum(law.numbers for law in found.problem.base.laws)


def _price(found: Fit, noise: float) -> float:
    """Return the penalty for one coefficient by the Bayesian information criterion, in units of the sum of squares."""
    return noise * float(np.log(max(int(np.count_nonzero(found.problem.root_weight)), 2)))
