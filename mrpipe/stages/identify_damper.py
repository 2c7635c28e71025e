"""`identify-damper`: a parametric damper from bench tests, its rivals, and how well each does on unseen tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mrpipe.errors import StageSkipped
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.config.sections.identify_damper import IdentifyDamperSettings
    from mrpipe.fitting.comparison import Comparison, FitOptions, JudgedFit


def _run(context: StageContext) -> Mapping[str, Any]:
    import numpy as np

    from mrpipe.dampers.library import forms_named
    from mrpipe.fitting.comparison import compare_forms
    from mrpipe.fitting.samples import smooth_motion
    from mrpipe.fitting.summary import findings
    from mrpipe.reporting import identify_damper as section
    from mrpipe.signals.prepared import read_prepared

    settings = context.settings.identify_damper
    tests = read_prepared(context.artifact("prepare"))
    if settings.smooth_motion:
        tests = smooth_motion(tests)
    training = [test for test in tests if test.role == "training"]
    if not training:
        raise StageSkipped("identify-damper: the campaign has no training test")
    by_choice = settings.form == "best"
    named = [*settings.compare, *([] if by_choice or not settings.compare else [settings.form])]
    forms = forms_named(list(dict.fromkeys(named)), settings.form_files)
    if not by_choice and settings.form not in forms:
        forms_named([settings.form], settings.form_files)
    comparison = compare_forms(
        list(forms.values()),
        tests,
        fit_options(settings),
        folds=settings.folds if by_choice else 0,
        keep=(*settings.compare, *(() if by_choice else (settings.form,))),
        jobs=context.jobs,
        progress=context.progress,
    )
    chosen = _chosen(comparison, settings.form)
    for line in findings(chosen.fit):
        context.warn(line)
    summary = _summary(comparison, chosen, settings.reference_A)
    largest = {
        "displacement": max(float(np.abs(test.displacement_m).max()) for test in training),
        "velocity": max(float(np.abs(test.velocity_m_s).max()) for test in training),
    }
    _write(context, comparison.judged, chosen, summary, largest)
    section.describe(context.report, section.IdentifiedDamper(tests, comparison.judged, chosen, summary))
    return summary


def fit_options(settings: IdentifyDamperSettings) -> FitOptions:
    """Return how forms are fitted, from the settings."""
    from mrpipe.dampers.library import form_of_file
    from mrpipe.fitting.comparison import FitOptions
    from mrpipe.fitting.form_fit import FitMethod

    files = {form_of_file(path).name: str(path) for path in settings.form_files}
    return FitOptions(
        method=FitMethod(settings.method, settings.starts, assumed_eta=settings.assumed_eta_per_s, form_files=files),
        cycles=settings.cycles,
        maximum_samples=settings.maximum_samples,
        raw_force=settings.force == "raw",
        offsets=settings.offset_per_test,
        equal_tests=settings.equal_tests,
        drive_law=settings.drive_law,
        yield_order=settings.yield_order,
        viscosity_order=settings.viscosity_order,
    )


def _chosen(comparison: Comparison, form: str) -> JudgedFit:
    from mrpipe.fitting.comparison import best_by_folds

    judged = comparison.judged
    return best_by_folds(judged) if form == "best" else next(item for item in judged if item.fit.form.name == form)


def _summary(comparison: Comparison, chosen: JudgedFit, reference: float) -> dict[str, Any]:
    from mrpipe.fitting.comparison import reason_of_choice
    from mrpipe.fitting.summary import (
        comparison_rows,
        correlation_rows,
        law_summary,
        number_or_none,
        parameter_table,
        rank_rows,
        test_rows,
        thesis_table,
    )

    model = chosen.fit.model
    return {
        "form": chosen.fit.form.name,
        "source": chosen.fit.form.source,
        "reason": reason_of_choice(chosen, comparison.judged),
        "drive_unit": model.drive_unit,
        "drive_limit": model.drive_limit,
        "drive_law": law_summary(comparison, chosen),
        "parameters": parameter_table(chosen.fit),
        "thesis_parameters": thesis_table(chosen.fit, reference),
        "training_nrmse": chosen.training.nrmse,
        "validation_nrmse": number_or_none(chosen.validation.nrmse),
        "validation_fit_percent": number_or_none(chosen.validation.fit_percent),
        "validation_r2": number_or_none(chosen.validation.r2),
        "comparison": comparison_rows(comparison.judged),
        "ranking": rank_rows(comparison),
        "correlated": correlation_rows(chosen.fit),
        "start_nrmse": list(chosen.fit.start_nrmse),
        "tests": test_rows(chosen),
    }


def _write(
    context: StageContext,
    judged: Sequence[JudgedFit],
    chosen: JudgedFit,
    summary: Mapping[str, Any],
    largest: Mapping[str, float],
) -> None:
    from mrpipe.dampers.model import write_damper, write_tested

    fit = chosen.fit
    with context.write("damper.h5") as artifact:
        write_damper(artifact, fit.model)
        write_tested(artifact, largest)
        for item in judged:
            write_damper(artifact, item.fit.model, f"forms/{item.fit.form.name}")
        dims = ("parameter", "parameter_of_column")
        artifact.put("covariance", fit.covariance, unit="1", dims=dims, description="units: those of the parameters")
        artifact.put("correlation", fit.correlation, unit="1", dims=dims)
        artifact.put_json("parameter_names", list(fit.names))
        for name in ("parameters", "thesis_parameters", "comparison", "ranking", "drive_law", "tests"):
            artifact.put_json(name, summary[name])


STAGE = Stage(
    name="identify-damper",
    summary="Fit the parametric damper model to the bench tests.",
    run=_run,
    inputs=("prepare",),
    after=("train-inverse",),
    settings=("identify_damper",),
    outputs=("damper.h5",),
)
