"""`train-inverse`: the network from motion and force to drive, its round trip and the emulation of viscous damping."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.networks.evaluation import Judgement
    from mrpipe.networks.plan import TrainingPlan


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import require_varying
    from mrpipe.networks.assembly import drive_range
    from mrpipe.networks.evaluation import judge
    from mrpipe.networks.network import read_network, write_network
    from mrpipe.networks.plan import fit_doubt, training_plan, training_summary
    from mrpipe.networks.tracking import judge_tracking
    from mrpipe.networks.training import train
    from mrpipe.reporting import train_inverse as section

    settings = context.settings.train_inverse
    plan = training_plan(settings, context.artifact("assemble"), context.artifact("sweep").json("choice"), "inverse")
    training, validation = plan.training, plan.validation
    span = drive_range(training)
    require_varying(
        {name: training.record(index, "drive") for index, name in enumerate(training.names)},
        str(context.inputs["assemble"]),
    )
    trained = train(
        training,
        plan.spec,
        plan.options,
        context.rng,
        normalisation=plan.normalisation,
        jobs=context.jobs,
        progress=context.progress,
    )
    judged = judge(trained.network, training, validation)
    signed = _signed(context, plan) if settings.compare_signed and plan.spec.absolute else None
    with context.write("inverse.h5") as artifact:
        write_network(artifact, "network", trained.network)
        artifact.put_json("held_out", list(trained.held_out))
        artifact.put("path", trained.path, unit="1", dims=("iteration",), description="training NRMSE")
        artifact.put("drive_range", span, unit=training.drive_unit)
        if signed is not None:
            artifact.put_json("signed", _compared(signed))
    tracking = None
    if "train-forward" in context.inputs:
        forward = read_network(context.artifact("train-forward"), "network")
        tracking = judge_tracking(
            trained.network, forward, training, validation, settings.viscous, judged.yield_travel_m
        )
    for finding in (judged.finding, fit_doubt(judged, plan), tracking.finding if tracking else ""):
        if finding:
            context.warn(finding)
    compared = signed["signed"] if signed else None
    section.describe(context.report, section.TrainedInverse(trained, judged, validation, span, compared, tracking))
    return {
        **training_summary(trained, judged, plan),
        **_drive_errors(judged, training.drive_unit, span),
        **({"negative_drive_share_signed": signed["signed"].negative_share} if signed else {}),
        **(tracking.summary() if tracking else {}),
    }


def _drive_errors(judged: Judgement, unit: str, span: float) -> dict[str, Any]:
    """Return the errors of the drive over its range in the training tests."""
    return {
        "drive_unit": unit,
        f"drive_range_{unit.lower()}": span,
        "varying_drive_error_over_range": {name: item.rms / span for name, item in judged.varying_regimes.items()},
        "error_over_range": judged.pooled.rms / span,
        "linear_baseline_error_over_range": judged.linear.rms / span,
        "negative_drive_share": judged.negative_share,
    }


def _signed(context: StageContext, plan: TrainingPlan) -> dict[str, Judgement]:
    """Return the errors of two short trainings on the subsample that differ in the absolute values only."""
    from dataclasses import replace

    from mrpipe.networks.evaluation import judge
    from mrpipe.networks.training import train

    quick = plan.options.changed(starts=1, iterations=0)
    seed = int(context.rng.integers(2**63))
    found = {}
    for name, absolute in (("absolute", True), ("signed", False)):
        spec = replace(plan.spec, absolute=absolute)
        # the same generator for both: the same rows and the same records held out
        rng = type(context.rng)(type(context.rng.bit_generator)(seed))
        trained = train(plan.training, spec, quick, rng, normalisation=plan.normalisation, jobs=context.jobs)
        found[name] = judge(trained.network, plan.training, plan.validation)
    return found


def _compared(signed: Mapping[str, Judgement]) -> dict[str, dict[str, float]]:
    """Return the stored results of the two short trainings."""
    return {
        "nrmse": {name: item.pooled.nrmse for name, item in signed.items()},
        "negative_share": {name: item.negative_share for name, item in signed.items()},
    }


STAGE = Stage(
    name="train-inverse",
    summary="Train the inverse network: motion and force to drive.",
    run=_run,
    inputs=("assemble", "sweep"),
    optional_inputs=("train-forward",),
    settings=("train_inverse",),
    outputs=("inverse.h5",),
)
