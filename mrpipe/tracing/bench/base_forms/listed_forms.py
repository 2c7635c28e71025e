"""The base forms without effects whose errors are listed in the result of a tracing."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from mrpipe.dampers.library import base_form
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.start import fit_with_form
from mrpipe.tracing.bench.base_forms.fits_of_forms import on_all_tests
from mrpipe.tracing.bench.base_forms.race import Race

COMMON_FORMS = ("bouc-wen", "bouc-wen-n", "dahl", "yielding-part")
"""Base forms that are always listed, also if there was no race."""

SEARCH_STEPS = 3
"""Numerical technique: iterations of the common forms on all tests; they start from the fit to the draft."""


def listed_fits_without_effects(found: Fit, race: Race | None, *, jobs: int = 1) -> dict[str, Fit]:
    """Return name -> fit to all tests, without effects, of every base form that was tried.

    The shape parameters of the common forms are searched on all tests. The other forms keep the shape parameters of the
    draft, and their coefficients are fitted to all tests, because they are only listed.

    Parameters
    ----------
    found
        Fit of the declared form to all tests. It is the first form of the result.
    race
        The comparison of all base forms; None if there was none.
    jobs
        Threads.
    """
    drafted = {} if race is None else {item.form: item.fit for item in race.models if item.effects == race.own}
    coupled = frozenset() if race is None else race.coupled
    names = [name for name in dict.fromkeys((*COMMON_FORMS, *drafted)) if name != found.problem.base.name]

    def fitted(name: str) -> Fit:
        if name not in drafted:
            return fit_with_form(found, base_form(name), starts=1, iterations=8)
        steps = SEARCH_STEPS if name in COMMON_FORMS else 0
        return on_all_tests(drafted[name], found.problem, coupled, iterations=steps)

    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        return {found.problem.base.name: found, **dict(zip(names, pool.map(fitted, names), strict=True))}
