"""Laws of the drive chosen again once base form and effects are known."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mrpipe.dampers.laws import LARGEST_ORDER, for_blocks
from mrpipe.fitting.drive_cells import Cells, cells_of
from mrpipe.fitting.drive_laws import VISCOSITY_LAWS, YIELD_LAWS, adequate_laws, fit_laws, judge
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Base
from mrpipe.fitting.reference import with_own_laws
from mrpipe.fitting.start import distinct_levels, polynomial_laws
from mrpipe.tracing.bench.select import Selection


def with_laws_again(selection: Selection, yield_order: int, viscosity_order: int) -> Selection:
    """Return the selection whose chosen fit has the laws of the drive that its base form and effects leave room for.

    The baseline takes the simplest laws that cost nothing while something is missing. What is missing can hide the
    true law, so the laws are chosen again with the chosen model. They are kept where the fit improves by a material
    share of the noise.

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
    """Return the fit with the simplest laws of the drive that fit as well as the richest ones.

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


def _with_polynomials(found: Fit, yield_order: int, viscosity_order: int) -> Base:
    """Return the base of a fit with polynomials of these degrees, lowered to what the levels of drive determine."""
    base, levels = found.problem.base, distinct_levels(found.problem.recordings)
    return replace(base, laws=polynomial_laws(base.form, levels, yield_order, viscosity_order))


def _with_laws(found: Fit, base: Base) -> Fit:
    problem = replace(found.problem, base=base)
    return with_own_laws(fit(problem, start_of(problem, found.base_values, found.term_values), iterations=12))


def with_final_laws(selection: Selection, least_gain: float) -> Selection:
    """Return the selection whose chosen fit has the laws of the drive that predict best, whatever their kind.

    While effects are searched, the laws are polynomials of low degree, because a flexible law, or one that saturates,
    would hide what bends the drive. Once the names are final, this reason is gone. Laws take the place of the present
    ones where the fit improves by a material share of the noise, and where they predict inner levels of the drive that
    their fit has not seen at least as well.

    Parameters
    ----------
    selection
        Chosen model with its final names.
    least_gain
        Least share of the squared residual by which other laws must lower it.
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
    """Return the selection with a fit in place of the chosen one, also where this is the one without effects."""
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
    """Return the fit with the polynomials of highest degree that the levels determine, and its sums over the levels."""
    rich = _with_laws(found, _with_polynomials(found, LARGEST_ORDER, max(law.order for law in VISCOSITY_LAWS)))
    return rich, cells_of(rich)


def _with_best_laws(rich: Fit, cells: Cells, noise: float) -> Iterator[Fit]:
    """Yield the fit with the laws of least information criterion by the sums over the levels, if any can be judged."""
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
    """Return the weighted squares of a fit, raised by what the numbers of its laws cost."""
    samples = np.count_nonzero(found.problem.root_weight)
    return found.chi_square * samples + _price(found, noise) * sum(law.numbers for law in found.problem.base.laws)


def _price(found: Fit, noise: float) -> float:
    """Return what one number costs by the Bayesian information criterion, in units of the weighted squares."""
    return noise * float(np.log(max(int(np.count_nonzero(found.problem.root_weight)), 2)))
