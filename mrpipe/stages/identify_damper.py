"""`identify-damper`: parametric damper models from bench tests, and their errors on validation tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.errors import StageSkipped
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.fitting.comparison import Comparison, JudgedFit


def _run(context: StageContext) -> Mapping[str, Any]:
    import numpy as np

    from mrpipe.fitting.choice import compare_and_choose
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
    comparison, chosen = compare_and_choose(settings, tests, jobs=context.jobs, progress=context.progress)
    for line in findings(chosen.fit):
        context.warn(line)
    without_drive = not any(test.drive.any() for test in tests)
    summary = _summary(comparison, chosen, settings.reference_A, without_drive)
    largest = {
        "displacement": max(float(np.abs(test.displacement_m).max()) for test in training),
        "velocity": max(float(np.abs(test.velocity_m_s).max()) for test in training),
    }
    if summary["validation_fit_doubt"]:
        context.warn(summary["validation_fit_doubt"])
    _write(context, comparison, chosen, summary, largest)
    section.describe(context.report, section.IdentifiedDamper(tests, comparison.judged, chosen, summary))
    return summary


def _fit_doubt(chosen: JudgedFit) -> str | None:
    """Return why the fit on the validation tests is not defined, or says little; None otherwise."""
    from mrpipe.signals.error_size import doubt_about_fit

    if not any(test.role == "validation" for test in chosen.tests):
        return "the campaign has no validation test"
    return doubt_about_fit(chosen.validation.nrmse, chosen.validation.fit_percent, "force")


def _summary(comparison: Comparison, chosen: JudgedFit, reference: float, without_drive: bool) -> dict[str, Any]:
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
        "without_drive": without_drive,
        "drive_law": law_summary(comparison, chosen),
        "parameters": parameter_table(chosen.fit),
        "thesis_parameters": thesis_table(chosen.fit, reference),
        "training_nrmse": chosen.training.nrmse,
        "validation_nrmse": number_or_none(chosen.validation.nrmse),
        "validation_fit_percent": number_or_none(chosen.validation.fit_percent),
        "validation_r2": number_or_none(chosen.validation.r2),
        "validation_fit_doubt": _fit_doubt(chosen),
        "comparison": comparison_rows(comparison.judged),
        "ranking": rank_rows(comparison),
        "correlated": correlation_rows(chosen.fit),
        "start_nrmse": list(chosen.fit.start_nrmse),
        "tests": test_rows(chosen),
    }


def _write(
    context: StageContext,
    comparison: Comparison,
    chosen: JudgedFit,
    summary: Mapping[str, Any],
    largest: Mapping[str, float],
) -> None:
    from mrpipe.dampers.model import write_damper, write_tested

    fit = chosen.fit
    with context.write("damper.h5") as artifact:
        write_damper(artifact, fit.model)
        write_tested(artifact, largest)
        for item in comparison.judged:
            write_damper(artifact, item.fit.model, f"forms/{item.fit.form.name}")
        for name, model in comparison.ranked.items():
            write_damper(artifact, model, f"ranked/{name}")
        dims = ("parameter", "parameter_of_column")
        artifact.put("covariance", fit.covariance, unit="1", dims=dims, description="units: those of the parameters")
        artifact.put("correlation", fit.correlation, unit="1", dims=dims)
        artifact.put_json("parameter_names", list(fit.names))
        for name in ("parameters", "thesis_parameters", "comparison", "ranking", "drive_law", "tests"):
            artifact.put_json(name, summary[name])


def _check(settings: Any) -> None:
    """Check that the forms of the user's files can be read, and that the settings name known forms."""
    from mrpipe.dampers.library import forms_named
    from mrpipe.fitting.settings import BEST

    section = settings.identify_damper
    if section.form_files:
        forms_named(() if section.form == BEST else (section.form,), section.form_files)
        forms_named(section.compare, section.form_files, "identify_damper.compare")


STAGE = Stage(
    name="identify-damper",
    summary="Fit the parametric damper model to the bench tests.",
    run=_run,
    inputs=("prepare",),
    after=("train-inverse",),
    settings=("identify_damper",),
    outputs=("damper.h5",),
    check=_check,
)
