"""`train-forward`: the network from motion and drive to force."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.networks.evaluation import judge, judge_free_run
    from mrpipe.networks.network import write_network
    from mrpipe.networks.plan import fit_doubt, training_plan, training_summary
    from mrpipe.networks.training import train
    from mrpipe.reporting import train_forward as section

    choice = context.artifact("sweep").json("choice")
    plan = training_plan(context.settings.train_forward, context.artifact("assemble"), choice, "forward")
    trained = train(
        plan.training,
        plan.spec,
        plan.options,
        context.rng,
        normalisation=plan.normalisation,
        jobs=context.jobs,
        progress=context.progress,
    )
    judged = judge(trained.network, plan.training, plan.validation)
    with context.write("forward.h5") as artifact:
        write_network(artifact, "network", trained.network)
        artifact.put_json("held_out", list(trained.held_out))
        artifact.put("path", trained.path, unit="1", dims=("iteration",), description="training NRMSE")
    free = judge_free_run(trained.network, plan.validation)
    for finding in (judged.finding, fit_doubt(judged, plan)):
        if finding:
            context.warn(finding)
    section.describe(context.report, section.TrainedForward(trained, judged, plan.validation, free))
    summary = training_summary(trained, judged, plan)
    if free is not None:
        summary |= {"one_step_nrmse": judged.pooled.nrmse, "free_run_nrmse": free.nrmse, "free_run_r2": free.r2}
    return summary


STAGE = Stage(
    name="train-forward",
    summary="Train the forward network: motion and drive to force.",
    run=_run,
    inputs=("assemble", "sweep"),
    settings=("train_forward",),
    outputs=("forward.h5",),
)
