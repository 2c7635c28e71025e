"""Which of several effects are needed, and which are superfluous with another form of the others.

The search adds effects in simple forms, to a base form with simple laws of the drive. A second effect may then only
correct the form of the first effect, the laws, or the base form. Before it is named, richer forms of the other effects,
richer laws and the best rival base forms are tried without it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from mrpipe.fitting.engine import Fit
from mrpipe.fitting.reference import with_own_laws
from mrpipe.tracing.bench.base_forms.fits_of_forms import on_all_tests
from mrpipe.tracing.bench.base_forms.promotion import with_candidates
from mrpipe.tracing.bench.base_forms.race import Race
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects, named_places
from mrpipe.tracing.bench.rivals.other_base_forms import Orders, best_rival, with_rival_base_form
from mrpipe.tracing.bench.selection.refine import with_best_forms
from mrpipe.tracing.bench.selection.select import Selection, fit_on_draft_tests
from mrpipe.tracing.bench.selection.terms import other_places, with_terms_in_order


def without_superfluous(
    selection: Selection,
    declared: int,
    *,
    lead: float,
    orders: Orders,
    worth_a_try: float,
    race: Race | None = None,
    jobs: int = 1,
) -> Selection:
    """Return the selection without effects that richer forms, richer laws of the drive or a base form replace.

    An effect that is dropped is kept as a further term, whose cause is not proven.

    Parameters
    ----------
    selection
        Named effects with their fit.
    declared
        Number of terms that the campaign declares; they belong to the baseline and are never dropped.
    lead
        An effect is dropped if the fit without it has at most this multiple of the chi-square of the fit with it.
    orders
        Largest degrees of the laws of the drive.
    worth_a_try
        All base forms are tried with the best forms of the effects only if the excess of the chi-square over the noise,
        in units of the noise, exceeds this.
    race
        The models that were compared; None if no other base form is tried.
    jobs
        Threads.
    """
    kept = selection
    while kept.proven > 1 and len(kept.chosen.problem.terms) >= declared + 2:
        shorter = _shorter(kept, declared, lead, orders, jobs) or _with_rival(
            kept, declared, lead, orders, worth_a_try, race, jobs
        )
        if shorter is None:
            break
        kept = shorter
    return kept


def without_idle(named: NamedEffects, *, lead: float) -> NamedEffects:
    """Return the named effects without those that the model fits as well without, and why none remains.

    A fit with an effect may end in a better minimum of the other parameters than any fit without the effect has found.
    Then these parameters lower the error, and not the effect. Each effect is therefore left out once, and the other
    parameters are fitted again from where they ended. The reason is empty if effects remain.

    A delay of the drive below the sampling interval is not named either. The course of the command between two samples
    is not recorded, so that a command which is held until the next sample seems to act later.

    Parameters
    ----------
    named
        Named effects, without further terms.
    lead
        An effect is dropped if the fit without it has at most this multiple of the chi-square of the fit with it.
    """
    while named.selection.proven > 0 and named.places:
        chosen = named.selection.chosen
        unresolved = [place for place in named.places if _below_sampling_interval(chosen, place)]
        fits = [
            (with_own_laws(with_terms_in_order(chosen, other_places(chosen, place))), place)
            for place in unresolved or named.places
        ]
        best, place = min(fits, key=lambda item: item[0].chi_square)
        if not unresolved and best.chi_square > lead * chosen.chi_square:
            break
        named = named.without_one(place, best)
        if not named.selection.proven:
            name = chosen.problem.terms[place].effect.name
            why = f"the base form fits as well without {name}"
            if unresolved:
                why = f"{name} would be shorter than the sampling interval, which these records do not resolve"
            return replace(named, reason=f"no effect is named: {why}")
    return replace(named, reason="")


def _below_sampling_interval(found: Fit, place: int) -> bool:
    """Return whether a term only delays the drive, by less than the longest sampling interval of the records."""
    effect, values = found.problem.terms[place].effect, found.term_values[place]
    delays = [values[name] for name in effect.delays_of_drive if name in values]
    return bool(delays) and max(delays) < float(np.max(found.problem.recordings.recorded_dt))


def _shorter(kept: Selection, declared: int, lead: float, orders: Orders, jobs: int) -> Selection | None:
    """Return the selection without one of its named effects, under the same base form; None if each is needed."""
    small = fit_on_draft_tests(kept.chosen)
    named = named_places(kept, declared)
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        without = pool.map(lambda k: _without(small, k, named, orders), named)
        place, best = min(zip(named, without, strict=True), key=lambda item: item[1].chi_square)
    # richer forms of the full model only lower its error, so most pairs are confirmed without fitting them
    if best.chi_square > lead * small.chi_square:
        return None
    full = with_best_forms(small, named, jobs=jobs)
    if best.chi_square > lead * full.chi_square:
        return None
    # they were ranked on a share of the tests; all tests decide
    full, best = (on_all_tests(item, kept.chosen.problem) for item in (full, best))
    if best.chi_square > lead * full.chi_square:
        return None
    return replace(
        kept,
        chosen=best,
        proven=kept.proven - 1,
        # a round that compares the remaining effects with their rivals; the first round even if its winner was dropped
        rounds=kept.rounds[: place - declared] or kept.rounds[:1],
        extension=with_terms_in_order(full, [*other_places(full, place), place]),
    )


def _with_rival(
    kept: Selection,
    declared: int,
    lead: float,
    orders: Orders,
    worth_a_try: float,
    race: Race | None,
    jobs: int,
) -> Selection | None:
    """Return the selection without one of its named effects, under another base form; None if each is needed."""
    if race is None:
        return None
    small, named = fit_on_draft_tests(kept.chosen), named_places(kept, declared)
    sets = [other_places(small, place) for place in named]
    limit = (1.0 + worth_a_try) * kept.noise
    # the best forms only lower the error, and they take long
    full = with_best_forms(small, named, jobs=jobs) if small.chi_square > limit else None
    more = full if full is not None and full.chi_square > limit else None
    found = best_rival(kept, small, sets, declared, orders, race, jobs, full=more)
    if found is None or found[1].chi_square > lead * small.chi_square:
        return None
    rival, best = found
    if best.chi_square > lead * (full or with_best_forms(small, named, jobs=jobs)).chi_square:
        return None
    again = with_rival_base_form(kept, race, rival, best)
    return with_candidates(again, race) if again.chosen.chi_square <= lead * kept.chosen.chi_square else None


def _without(found: Fit, place: int, named: range, orders: Orders) -> Fit:
    """Return the fit without one term, with adequate laws of the drive and the best forms of the other named terms."""
    start = orders.adequate(with_terms_in_order(found, other_places(found, place)))
    return with_best_forms(start, range(named.start, named.stop - 1))
