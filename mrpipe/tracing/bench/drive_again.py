"""Laws of the drive chosen again once base form and effects are known."""

from __future__ import annotations

from dataclasses import replace

from mrpipe.fitting.drive_laws import adequate_laws
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
    if chosen is selection.ground:
        return replace(selection, chosen=found, ground=found)
    return replace(selection, chosen=found)


def with_adequate_laws(found: Fit, yield_order: int, viscosity_order: int) -> Fit:
    """Return the fit with the simplest laws of the drive that fit as well as the richest ones.

    Parameters
    ----------
    found
        Fit with or without effects.
    yield_order, viscosity_order
        Largest degrees of the polynomials that are tried.
    """
    base = found.problem.base
    richest = polynomial_laws(base.form, distinct_levels(found.problem.recordings), yield_order, viscosity_order)
    if base.laws == richest:
        return found
    rich = _with_laws(found, replace(base, laws=richest))
    return _with_laws(rich, replace(base, laws=adequate_laws(rich)))


def _with_laws(found: Fit, base: Base) -> Fit:
    problem = replace(found.problem, base=base)
    return with_own_laws(fit(problem, start_of(problem, found.base_values, found.term_values), iterations=12))
