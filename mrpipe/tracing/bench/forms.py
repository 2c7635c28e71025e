"""Other base forms than the declared one: alone, and with the effects that were found under the declared form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from mrpipe.dampers.form import BaseForm
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.start import fit_with_form, with_form
from mrpipe.tracing.bench.select import NOTHING_MISSING, Selection, draft
from mrpipe.tracing.bench.verdict import left_of

CLAIM_COST = 0.02
"""Share by which each fitted number, and thrice that by which each effect, counts against a model of like error."""

FORM_LEAD = 0.1
"""Share by which another base form alone must cost less than the declared form with effects. Without a clear lead the
declared form is kept, because a form with many numbers can imitate an effect."""

SCREENED = 8
"""Number of base forms, the best ones alone, that are tried with the effects found."""


def alone(base: Fit, forms: Mapping[str, BaseForm], noise: float, *, jobs: int = 1) -> dict[str, Fit]:
    """Return all base forms but that of `base`, fitted to a share of the tests, the best first."""
    small = draft(base)
    names = [name for name in forms if name != base.problem.base.name]
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        fits = pool.map(lambda name: fit_with_form(small, forms[name], starts=2, iterations=8), names)
        found = dict(zip(names, fits, strict=True))
    return dict(sorted(found.items(), key=lambda item: cost(item[1], noise)))


def with_effects_of(chosen: Fit, drafts: Mapping[str, Fit], *, jobs: int = 1) -> list[Fit]:
    """Return the best base forms with the effects of a fit, on a share of the tests."""

    def one(drafted: Fit) -> Fit:
        problem = replace(with_form(drafted, drafted.problem.base.form), terms=chosen.problem.terms)
        return fit(problem, start_of(problem, drafted.base_values, chosen.term_values), iterations=8, tolerance=1e-3)

    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return list(pool.map(one, list(drafts.values())[:SCREENED]))


def grounds(
    selection: Selection, drafts: Mapping[str, Fit], lead: float, least_share: float, *, jobs: int = 1
) -> list[Fit]:
    """Return other base forms, fitted to all tests, from which effects should be searched again.

    The best form alone, if it leaves less than any one effect under the declared form does; and the form that leaves
    clearly less with the effects that were found.

    Parameters
    ----------
    selection
        Effects under the declared base form.
    drafts
        Other base forms, fitted to a share of the tests, the best first.
    lead, least_share
        See :class:`mrpipe.tracing.bench.verdict.Rules`.
    jobs
        Threads.
    """
    base, chosen, noise = selection.base, selection.chosen, selection.noise
    if not drafts:
        return []
    names: list[str] = []
    best = next(iter(drafts))
    on_all = _on_all(drafts[best], base)
    effects: Sequence[Fit] = [item.fit for item in selection.rounds[0]]
    declared = min(cost(item, noise) for item in (*effects, chosen))
    if selection.share(on_all) >= least_share and (1.0 + FORM_LEAD) * cost(on_all, noise) <= declared:
        names.append(best)
    # effects that leave no more than noise under the declared form need no other form
    if len(chosen.problem.terms) > len(base.problem.terms) and chosen.chi_square > (1.0 + NOTHING_MISSING) * noise:
        rivals = with_effects_of(chosen, drafts, jobs=jobs)
        rival = min(rivals, key=lambda item: cost(item, noise))
        own = replace(chosen.problem, recordings=rival.problem.recordings, root_weight=rival.problem.root_weight)
        if (1.0 + lead) * cost(rival, noise) < cost(fit(own, chosen.theta, iterations=3), noise):
            names.append(rival.problem.base.name)
    return [on_all if name == best else _on_all(drafts[name], base) for name in dict.fromkeys(names)]


def cost(found: Fit, noise: float) -> float:
    """Return what a fit leaves beyond the noise, raised by its number of fitted numbers and effects."""
    problem = found.problem
    claims = len(problem.searched) + len(problem.amplitudes) + 3 * len(problem.terms)
    return left_of(found, noise) * (1.0 + CLAIM_COST * claims)


def _on_all(drafted: Fit, base: Fit) -> Fit:
    problem = replace(drafted.problem, recordings=base.problem.recordings, root_weight=base.problem.root_weight)
    return fit(problem, drafted.theta, iterations=10)
