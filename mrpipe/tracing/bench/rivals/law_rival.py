"""Laws of the drive that compete with an effect which limits the drive.

Every magnetic circuit has a yield force that levels off with the drive; this is a law of the base form. A driver or a
core that saturates limits the drive itself, so that the viscosity levels off too. While effects are searched, the laws
are polynomials. An effect that limits the drive can then replace a law that polynomials cannot represent. Therefore the
effect counts as proven only if it predicts tests left out better than a saturating law does.
"""

from __future__ import annotations

from dataclasses import replace

from mrpipe.fitting.drive_laws import YIELD_LAWS
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.reference import with_own_laws
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.rivals.other_base_forms import ITERATIONS, Unseen
from mrpipe.tracing.bench.selection.terms import other_places

LAWS = tuple(law for law in YIELD_LAWS if law.saturates)
"""Numerical technique: laws of the yield force that saturate, each with two coefficients and a scale."""


def without_laws_of_drive(named: NamedEffects, unseen: Unseen, jobs: int = 1) -> NamedEffects:
    """Return the named effects without one that a law of the drive replaces, and why none remains.

    The law replaces an effect that limits the drive if it predicts tests left out as well. The reason is empty if
    effects remain, or if no effect was replaced.

    Parameters
    ----------
    named
        Named effects, without further terms.
    unseen
        Comparison on tests that were left out.
    jobs
        Threads.
    """
    chosen = named.selection.chosen
    place = next((place for place in named.places if chosen.problem.terms[place].effect.law_of_drive), None)
    if place is None:
        return named
    rival = best_law(chosen, place)
    if unseen.better(rival, chosen, jobs):
        return named
    found = named.without_one(place, rival)
    if found.selection.proven:
        return found
    reason = (
        f"no effect is named: {chosen.problem.terms[place].effect.name} lowers the error, but a yield force that "
        f"levels off with the drive ({rival.problem.base.laws[0].kind} law) predicts tests that were left out as well"
    )
    return replace(found, reason=reason)


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
    rest = other_places(found, place)
    terms, values = tuple(problem.terms[k] for k in rest), [found.term_values[k] for k in rest]
    fits = []
    for law in LAWS:
        base = replace(problem.base, laws=(law, *problem.base.laws[1:]))
        trial = replace(problem, base=base, terms=terms)
        fits.append(with_own_laws(fit(trial, start_of(trial, found.base_values, values), iterations=ITERATIONS)))
    return min(fits, key=lambda item: item.chi_square)
