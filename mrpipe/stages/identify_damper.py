"""`identify-damper`: a parametric damper from bench tests, its rivals, and how well each does on unseen tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mrpipe.errors import StageSkipped
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.dampers.comparison import JudgedFit


def _run(context: StageContext) -> Mapping[str, Any]:
    import numpy as np

    from mrpipe.dampers.comparison import FitOptions, compare_forms
    from mrpipe.dampers.forms import FORMS
    from mrpipe.dampers.samples import scales_of, smooth_motion
    from mrpipe.dampers.summary import findings
    from mrpipe.reporting import identify_damper as section
    from mrpipe.signals.prepared import read_prepared

    settings = context.settings.identify_damper
    tests = read_prepared(context.artifact("prepare"))
    if settings.smooth_motion:
        tests = smooth_motion(tests)
    training = [test for test in tests if test.role == "training"]
    if not training:
        raise StageSkipped("identify-damper: the campaign has no training test")
    scales = scales_of(
        training,
        yield_order=settings.yield_order,
        viscosity_order=settings.viscosity_order,
        assumed_eta=settings.assumed_eta_per_s,
    )
    options = FitOptions(
        method=settings.method,
        starts=settings.starts,
        cycles=settings.cycles,
        maximum_samples=settings.maximum_samples,
        raw_force=settings.force == "raw",
        offsets=settings.offset_per_test,
        equal_tests=settings.equal_tests,
    )
    by_choice = settings.form == "best"
    names = list(dict.fromkeys([*settings.compare, *([] if by_choice else [settings.form])]))
    judged = compare_forms(
        [FORMS[name] for name in names],
        tests,
        scales,
        options,
        folds=settings.folds if by_choice else 0,
        progress=context.progress,
    )
    chosen = _chosen(judged, settings.form)
    for line in findings(chosen.fit):
        context.warn(line)
    summary = _summary(judged, chosen, settings.reference_A)
    largest = {
        "displacement": max(float(np.abs(test.displacement_m).max()) for test in training),
        "velocity": max(float(np.abs(test.velocity_m_s).max()) for test in training),
    }
    _write(context, judged, chosen, summary, largest)
    section.describe(context.report, section.IdentifiedDamper(tests, judged, chosen, summary))
    return summary


def _chosen(judged: Sequence[JudgedFit], form: str) -> JudgedFit:
    from mrpipe.dampers.comparison import best_by_folds

    return best_by_folds(judged) if form == "best" else next(item for item in judged if item.fit.form.name == form)


def _summary(judged: Sequence[JudgedFit], chosen: JudgedFit, reference: float) -> dict[str, Any]:
    from mrpipe.dampers.summary import (
        comparison_rows,
        correlation_rows,
        number_or_none,
        parameter_table,
        test_rows,
        thesis_table,
    )

    model = chosen.fit.model
    return {
        "form": chosen.fit.form.name,
        "drive_unit": model.drive_unit,
        "drive_limit": model.drive_limit,
        "parameters": parameter_table(chosen.fit),
        "thesis_parameters": thesis_table(chosen.fit, reference),
        "training_nrmse": chosen.training.nrmse,
        "validation_nrmse": number_or_none(chosen.validation.nrmse),
        "validation_fit_percent": number_or_none(chosen.validation.fit_percent),
        "validation_r2": number_or_none(chosen.validation.r2),
        "comparison": comparison_rows(judged),
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
        artifact.put_json("parameters", summary["parameters"])
        artifact.put_json("thesis_parameters", summary["thesis_parameters"])
        artifact.put_json("comparison", summary["comparison"])
        artifact.put_json("tests", summary["tests"])


STAGE = Stage(
    name="identify-damper",
    summary="Fit the parametric damper model to the bench tests.",
    run=_run,
    inputs=("prepare",),
    after=("train-inverse",),
    settings=("identify_damper",),
    outputs=("damper.h5",),
)
