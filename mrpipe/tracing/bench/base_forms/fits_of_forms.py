"""Fits of many base forms: without effects, with the effects of another fit, and on all training tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.library import forms_named
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.known import Known
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.reference import with_own_laws
from mrpipe.fitting.start import fit_with_form, own_start
from mrpipe.tracing.bench.selection.select import fit_on_draft_tests
from mrpipe.tracing.options import TracingOptions


def fits_without_effects(
    small: Fit, forms: Mapping[str, BaseForm], *, known: Known | None = None, jobs: int = 1
) -> dict[str, Fit]:
    """Return name -> fit of all base forms to the tests of a draft; the form of the draft is not fitted again.

    Parameters
    ----------
    small
        Fit of the declared form to the draft.
    forms
        Base forms by name.
    known
        Base forms as they were fitted to the same tests before: where the search of each begins.
    jobs
        Threads.
    """
    own = small.problem.base.name
    names = [name for name in forms if name != own]

    def fitted(name: str) -> Fit:
        # effects are proportional to the laws of the form that they are added to, not to those of the declared form
        return with_own_laws(fit_with_form(small, forms[name], starts=1, iterations=8, known=known))

    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        fits = pool.map(fitted, names)
        return {own: small, **dict(zip(names, fits, strict=True))}


def compared_fits_without_effects(
    found: Fit, options: TracingOptions, *, known: Known | None = None, jobs: int = 1
) -> dict[str, Fit]:
    """Return all base forms that are compared, fitted without effects to the draft of a fit.

    Springs of base forms are left to the effect `accumulator`.
    """
    forms = forms_named(options.base_forms, options.form_files)
    return fits_without_effects(
        fit_on_draft_tests(found),
        {name: form.without_springs() for name, form in forms.items()},
        known=known,
        jobs=jobs,
    )


def with_effects_of(chosen: Fit, singles: Sequence[Fit], *, iterations: int = 8, jobs: int = 1) -> list[Fit]:
    """Return fits of other base forms with the effects of a fit, on the same tests.

    The forms were fitted without effects before. The laws of the drive that their steps read are fitted again, because
    without the effect they imitate it. For the same reason a fit also begins at the starts of the form.
    """

    def one(drafted: Fit) -> Fit:
        problem = replace(drafted.problem, terms=chosen.problem.terms)
        starts = [start_of(problem, drafted.base_values, chosen.term_values)]
        if not problem.base.form.coupled:
            starts.append(own_start(problem, chosen))
        fits = [fit(problem, start, iterations=iterations, tolerance=1e-3) for start in starts]
        found = min(fits, key=lambda item: item.chi_square)
        return with_own_laws(found, iterations=iterations // 2)

    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return list(pool.map(one, singles))


def on_all_tests(drafted: Fit, problem: Problem, coupled: frozenset[str] = frozenset(), *, iterations: int = 10) -> Fit:
    """Return a model of the race, fitted to all training tests.

    Parameters
    ----------
    drafted
        Fit on the draft.
    problem
        Problem of the baseline, which gives recordings and weights.
    coupled
        See :class:`Race`; for these forms the laws that the steps read are fitted again.
    iterations
        Iterations of the search.
    """
    base = drafted.problem.base
    if base.name in coupled:
        base = replace(base, form=replace(base.form, coupled=True))
    whole = replace(drafted.problem, base=base).on_samples_of(problem)
    return with_own_laws(fit(whole, drafted.theta, iterations=iterations))
