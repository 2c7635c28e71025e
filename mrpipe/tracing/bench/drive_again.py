"""Laws of the drive chosen again once effects are known."""

from __future__ import annotations

from dataclasses import replace

from mrpipe.fitting.drive_laws import adequate_laws
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Base
from mrpipe.tracing.bench.select import NOTHING_MISSING, Selection


def with_laws_again(selection: Selection, declared: Base) -> Selection:
    """Return the selection whose chosen fit has the laws of the drive that its effects leave room for.

    The baseline takes the simplest laws that cost nothing while an effect is missing. The missing effect can hide the
    true law, so the laws are chosen again with the effects in the model. They are kept where the fit improves by a
    material share of the noise.

    Parameters
    ----------
    selection
        Effects under the declared base form.
    declared
        The declared base form with the richest laws that the drive levels determine.
    """
    chosen = selection.chosen
    base = chosen.problem.base
    if base.form.name != declared.form.name or base.laws == declared.laws or chosen is selection.base:
        return selection
    rich = _with_laws(chosen, replace(base, laws=declared.laws))
    found = _with_laws(rich, replace(base, laws=adequate_laws(rich)))
    if found.chi_square < chosen.chi_square - NOTHING_MISSING * selection.noise:
        return replace(selection, chosen=found)
    return selection


def _with_laws(found: Fit, base: Base) -> Fit:
    problem = replace(found.problem, base=base)
    return fit(problem, start_of(problem, found.base_values, found.term_values), iterations=12)
