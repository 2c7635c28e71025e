"""Laws of the drive that compete with an effect which limits the drive.

Every magnetic circuit has a yield force that levels off with the drive; this is a law of the base form. A driver or a
core that saturates limits the drive itself, so that the viscosity levels off too. While effects are searched, the laws
are polynomials. An effect that limits the drive can then replace a law that polynomials cannot represent. Therefore the
effect counts as proven only if it predicts tests left out better than a saturating law does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mrpipe.fitting.drive_laws import YIELD_LAWS
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.reference import with_own_laws
from mrpipe.tracing.bench.rivals.needed import without_one
from mrpipe.tracing.bench.rivals.other_base_forms import ITERATIONS, Unseen
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.gain import Gain

LAWS = tuple(law for law in YIELD_LAWS if law.saturates)
"""Numerical technique: laws of the yield force that saturate, each with two coefficients and a scale."""


def without_laws_of_drive(
    selection: Selection, gains: Sequence[Gain | None], declared: int, unseen: Unseen, jobs: int = 1
) -> tuple[Selection, list[Gain | None], str]:
    """Return the selection, its gains, and why an effect is not named if a law of the drive predicts as well.

    The law then replaces the effect. The reason is empty if effects remain, or if no effect was replaced.

    Parameters
    ----------
    selection
        Named effects with their fit, without further terms.
    gains
        Gains of the named effects on tests that were left out.
    declared
        Number of terms that the campaign declares; they are part of every model.
    unseen
        Comparison on tests that were left out.
    jobs
        Threads.
    """
    kept = list(gains)
    chosen = selection.chosen
    last = min(declared + selection.proven, len(chosen.problem.terms))
    places = [place for place in range(declared, last) if chosen.problem.terms[place].effect.law_of_drive]
    if not places:
        return selection, kept, ""
    place = places[0]
    rival = best_law(chosen, place)
    if unseen.better(rival, chosen, jobs):
        return selection, kept, ""
    name = chosen.problem.terms[place].effect.name
    found, kept = without_one(selection, kept, place, declared, rival)
    if found.proven:
        return found, kept, ""
    return (
        found,
        kept,
        (
            f"no effect is named: {name} lowers the error, but a yield force that levels off with the drive "
            f"({rival.problem.base.laws[0].kind} law) predicts tests that were left out as well"
        ),
    )


def best_law(found: Fit, place: int) -> Fit:
    """Return the fit without one of its terms, with the best saturating law of the yield force.

    Parameters
    ----------
    found
        Fit with effects.
    place
        Which of its terms is left out.
    """
    problem = found.problem
    terms = tuple(item for k, item in enumerate(problem.terms) if k != place)
    values = [item for k, item in enumerate(found.term_values) if k != place]
    fits = []
    for law in LAWS:
        base = replace(problem.base, laws=(law, *problem.base.laws[1:]))
        trial = replace(problem, base=base, terms=terms)
        fits.append(with_own_laws(fit(trial, start_of(trial, found.base_values, values), iterations=ITERATIONS)))
    return min(fits, key=lambda item: item.chi_square)
