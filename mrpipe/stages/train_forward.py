"""`train-forward`: the network from motion and drive to force, and what both training stages share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.networks.assembly import History
    from mrpipe.networks.evaluation import Judgement
    from mrpipe.networks.network import FeatureSpec, Network
    from mrpipe.networks.training import Trained, TrainingOptions

THESIS_HIDDEN = (6, 6)


def training_plan(context: StageContext, settings: Any, kind: str) -> tuple[FeatureSpec, TrainingOptions]:
    """Return the features and options that settings, training set and sweep ask for (`kind`: forward or inverse)."""
    from dataclasses import replace

    from mrpipe.networks.levenberg_marquardt import StoppingRules
    from mrpipe.networks.network import spec_from_json
    from mrpipe.networks.training import TrainingOptions

    training = context.artifact("assemble")
    spec = spec_from_json(training.json(f"{kind}/features"))
    biases = settings.biases
    if settings.architecture == "sweep":
        choice = context.artifact("sweep").json("choice")
        hidden, biases = tuple(choice["hidden"]), choice["biases"]
        spec = replace(spec, past_values=choice["past_values"])
        if kind == "forward":
            spec = replace(spec, channels=tuple(choice["channels"]))
    else:
        hidden = THESIS_HIDDEN if settings.architecture == "thesis" else tuple(settings.architecture)
    rules = StoppingRules(
        held_out_failures=settings.held_out_failures,
        gradient=settings.gradient_tolerance,
        improvement=settings.improvement_tolerance,
        mu=settings.mu,
        mu_increase=settings.mu_increase,
        mu_decrease=settings.mu_decrease,
        mu_maximum=settings.mu_maximum,
    )
    return spec, TrainingOptions(
        hidden=hidden,
        biases=biases,
        starts=settings.starts,
        refined_starts=settings.refined_starts,
        method=settings.method,
        rules=rules,
        subsample_rows=settings.subsample_rows,
        subsample_iterations=settings.subsample_iterations,
        iterations=settings.iterations,
        refined_rows=settings.refined_rows,
        refine_on=settings.refine_on,
        averaged=settings.averaged,
        initial=settings.initial,
        normalisation=training.attributes("/")["normalisation"],
        whitened=settings.whitened,
        held_out_share=settings.held_out_share,
        weight_decay=settings.weight_decay,
    )


def summary_of(trained: Trained, judged: Judgement) -> dict[str, Any]:
    """Return what both training stages print; the keys are those of the contract."""
    network = trained.network
    held_out = [start.held_out_nrmse for start in trained.starts]
    return {
        "architecture": network.architecture,
        "members": network.members,
        "training_nrmse": judged.training.nrmse,
        "validation_nrmse": judged.pooled.nrmse,
        "validation_fit_percent": judged.pooled.fit_percent,
        "parameters": network.parameters,
        "iterations": trained.iterations,
        "seconds": trained.seconds,
        "r2": judged.pooled.r2,
        "linear_baseline_nrmse": judged.linear.nrmse,
        "linear_baseline_r2": judged.linear.r2,
        "regime_nrmse": {name: figures.nrmse for name, figures in judged.regimes.items()},
        "yield_travel_m": judged.yield_travel_m,
        "constant_drive_nrmse": judged.constant.nrmse,
        "varying_drive_nrmse": judged.varying.nrmse,
        "held_out_nrmse_of_starts": held_out,
        "starts": len(trained.starts),
        "biases": network.has_biases,
        "inputs": list(network.features.channels),
        "past_values": network.features.past_values,
        "sampling_rate_hz": network.features.sampling_rate_hz,
        "outside_training_range_share": judged.outside_training_range,
    }


def report_training(context: StageContext, trained: Trained, judged: Judgement, unit: str) -> None:
    """Write what both training stages show: starts, per-test errors, regimes."""
    import pandas as pd

    from mrpipe.reporting import networks as figures

    network, pooled = trained.network, judged.pooled
    spread = [start.held_out_nrmse for start in trained.starts]
    context.report.text(
        f"Network {network.architecture} ({network.parameters} parameters, {'with' if network.has_biases else 'no'} "
        f"biases), {_taken(network)} of {len(trained.starts)} starts on {len(trained.held_out)} held-out training "
        "records. "
        f"On the validation tests: NRMSE {pooled.nrmse:.4f}, fit {pooled.fit_percent:.1f} %, R2 {pooled.r2:.4f}; "
        f"a linear model of the same inputs reaches {judged.linear.nrmse:.3f}."
    )
    if spread:
        context.report.text(f"The starts spread from {min(spread):.4f} to {max(spread):.4f} before refinement.")
    context.report.table("errors", pd.DataFrame(judged.rows(unit)), "Errors on the validation tests.")
    context.report.table("tests", pd.DataFrame(judged.test_rows(unit)), "Errors of each validation test.")
    context.report.table(
        "starts",
        pd.DataFrame(
            [
                {
                    "start": number,
                    "training NRMSE (subsample)": start.subsample_nrmse,
                    "held-out NRMSE": start.held_out_nrmse,
                    "held-out NRMSE, all rows": start.refined_held_out_nrmse,
                    "iterations": start.iterations,
                    "ended by": start.reason,
                }
                for number, start in enumerate(trained.starts, start=1)
            ]
            # no held-out error after a second phase that learned the held-out records
        ).dropna(axis="columns", how="all"),
        "Every start.",
    )
    context.report.figure(
        "training",
        figures.training_progress(trained.path, [start.held_out_nrmse for start in trained.starts]),
        "Training error of the chosen start, and the held-out error of all.",
    )
    if judged.outside_training_range > 0.01:
        context.warn(
            f"{100 * judged.outside_training_range:.1f} % of the validation samples lie outside the training range"
        )


def _taken(network: Network) -> str:
    if network.members == 1:
        return "the best"
    inner = "-".join(str(count) for count in network.hidden_of_members)
    return f"the mean of {network.members} networks of {inner} that stand side by side in it, the best"


def histories_of(context: StageContext) -> tuple[History, History]:
    """Return the training and the validation history."""
    from mrpipe.networks.assembly import read_history

    training = context.artifact("assemble")
    return read_history(training, "training"), read_history(training, "validation")


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.networks.evaluation import error_figures, free_run, judge
    from mrpipe.networks.network import write_network
    from mrpipe.networks.training import train
    from mrpipe.reporting import networks as figures

    training, validation = histories_of(context)
    spec, options = training_plan(context, context.settings.train_forward, "forward")
    trained = train(training, spec, options, context.rng, jobs=context.jobs, progress=context.progress)
    judged = judge(trained.network, training, validation)
    with context.write("forward.h5") as artifact:
        write_network(artifact, "network", trained.network)
        artifact.put_json("held_out", list(trained.held_out))
        artifact.put("path", trained.path, unit="1", dims=("iteration",), description="training NRMSE")
    summary = summary_of(trained, judged)
    if spec.past_target:
        feedback = error_figures(validation.channels["force"], free_run(trained.network, validation))
        summary |= {"one_step_nrmse": judged.pooled.nrmse, "free_run_nrmse": feedback.nrmse, "free_run_r2": feedback.r2}
        context.report.text(f"One step ahead NRMSE {judged.pooled.nrmse:.4f}; running freely {feedback.nrmse:.4f}.")
    report_training(context, trained, judged, "N")
    context.report.figure(
        "loops",
        figures.force_loops(validation, judged.samples, judged.estimated),
        "Force against displacement and velocity on validation tests (thesis Figures 2.17 to 2.20).",
    )
    return summary


STAGE = Stage(
    name="train-forward",
    summary="Train the forward network: motion and drive to force.",
    run=_run,
    inputs=("assemble", "sweep"),
    settings=("train_forward",),
    outputs=("forward.h5",),
)
