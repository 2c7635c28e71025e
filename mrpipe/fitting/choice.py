"""The damper model that the settings require: which base forms are fitted, and which of them is chosen."""

from __future__ import annotations

from collections.abc import Sequence

from mrpipe.artifacts import Progress, no_progress
from mrpipe.dampers.library import forms_named
from mrpipe.fitting.comparison import Comparison, FitOptions, JudgedFit, best_by_folds, compare_forms
from mrpipe.fitting.form_fit import FitMethod
from mrpipe.fitting.settings import BEST, IdentifyDamperSettings
from mrpipe.signals.prepared import PreparedTest


def compare_and_choose(
    settings: IdentifyDamperSettings,
    tests: Sequence[PreparedTest],
    *,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> tuple[Comparison, JudgedFit]:
    """Fit the forms that the settings name, and choose one: the named form, or the best form on tests left out.

    Parameters
    ----------
    settings
        Forms, and how they are fitted.
    tests
        Prepared tests; at least one has the role `training`.
    jobs
        Threads; the result does not depend on their number.
    progress
        Called with the share of the work that is done (0 to 1) and a text.

    Raises
    ------
    UserError
        If no base form has one of the names.
    """
    by_choice = settings.form == BEST
    demanded = () if by_choice else (settings.form,)
    compared = [*settings.compare, *(demanded if settings.compare else ())]
    forms = forms_named(list(dict.fromkeys(compared)), settings.form_files)
    if not by_choice and settings.form not in forms:
        # raises the error that names the nearest form
        forms_named([settings.form], settings.form_files)
    comparison = compare_forms(
        list(forms.values()),
        tests,
        fit_options(settings),
        folds=settings.folds if by_choice else 0,
        keep=(*settings.compare, *demanded),
        jobs=jobs,
        progress=progress,
    )
    judged = comparison.judged
    chosen = best_by_folds(judged) if by_choice else next(x for x in judged if x.fit.form.name == settings.form)
    return comparison, chosen


def fit_options(settings: IdentifyDamperSettings) -> FitOptions:
    """Return how forms are fitted, from the settings."""
    return FitOptions(
        method=FitMethod(settings.method, settings.starts, assumed_eta=settings.assumed_eta_per_s),
        cycles=settings.cycles,
        maximum_samples=settings.maximum_samples,
        raw_force=settings.force == "raw",
        offsets=settings.offset_per_test,
        equal_tests=settings.equal_tests,
        drive_law=settings.drive_law,
        yield_order=settings.yield_order,
        viscosity_order=settings.viscosity_order,
    )
