"""`train-inverse`: the network from motion and force to drive, its round trip and the emulation of viscous damping."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.stages.train_forward import histories_of, report_training, summary_of, training_plan

if TYPE_CHECKING:
    from mrpipe.networks.assembly import History
    from mrpipe.networks.network import Network


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import require_varying
    from mrpipe.networks.assembly import drive_range
    from mrpipe.networks.evaluation import judge
    from mrpipe.networks.network import write_network
    from mrpipe.networks.training import train
    from mrpipe.reporting import networks as figures

    training, validation = histories_of(context)
    span = drive_range(training)
    require_varying(
        {name: training.record(index, "drive") for index, name in enumerate(training.names)},
        str(context.inputs["assemble"]),
    )
    spec, options = training_plan(context, context.settings.train_inverse, "inverse")
    trained = train(training, spec, options, context.rng, jobs=context.jobs, progress=context.progress)
    judged = judge(trained.network, training, validation)
    unit = training.drive_unit
    with context.write("inverse.h5") as artifact:
        write_network(artifact, "network", trained.network)
        artifact.put_json("held_out", list(trained.held_out))
        artifact.put("path", trained.path, unit="1", dims=("iteration",), description="training NRMSE")
        artifact.put("drive_range", span, unit=unit)
    varying = judged.varying_regimes
    summary = summary_of(trained, judged) | {
        "drive_unit": unit,
        f"drive_range_{unit.lower()}": span,
        "varying_drive_error_over_range": {name: item.rms / span for name, item in varying.items()},
        "error_over_range": judged.pooled.rms / span,
        "negative_drive_share": judged.negative_share,
    }
    report_training(context, trained, judged, unit)
    context.report.figure(
        "drive",
        figures.drive_histories(validation, judged.samples, judged.estimated),
        "Drive measured and estimated on validation tests (thesis Figures 2.21 to 2.23).",
    )
    if context.settings.train_inverse.compare_signed and spec.absolute:
        summary["negative_drive_share_signed"] = _signed_share(context, training, validation)
    if "train-forward" in context.inputs:
        summary |= _tracking(context, trained.network, training, validation, judged.yield_travel_m)
    else:
        context.report.text("There is no forward network, so round trip and viscous emulation are left out.")
    return summary


def _signed_share(context: StageContext, training: History, validation: History) -> float:
    """Return the share of negative drive of a network on signed values, trained on the subsample only."""
    from dataclasses import replace

    from mrpipe.networks.evaluation import judge
    from mrpipe.networks.training import train

    spec, options = training_plan(context, context.settings.train_inverse, "inverse")
    quick = replace(options, starts=min(2, options.starts), iterations=0)
    signed = train(training, replace(spec, absolute=False), quick, context.rng, jobs=context.jobs)
    judged = judge(signed.network, training, validation)
    context.report.text(
        f"On signed values (a short training) the estimate is negative in {100 * judged.negative_share:.1f} % of the "
        f"samples, NRMSE {judged.pooled.nrmse:.4f}."
    )
    return judged.negative_share


def _tracking(
    context: StageContext, inverse: Network, training: History, validation: History, yield_travel_m: float
) -> dict[str, Any]:
    """Judge the round trip on the validation tests and emulate a viscous damper."""
    from mrpipe.networks.evaluation import by_regime, error_figures, regimes_of
    from mrpipe.networks.network import read_network
    from mrpipe.networks.tracking import emulate_viscous, round_trip
    from mrpipe.reporting import networks as figures

    forward = read_network(context.artifact("train-forward"), "network")
    limit = float(training.channels["drive"].max())
    trip = round_trip(inverse, forward, validation, limit)
    pooled = error_figures(trip.desired_n, trip.force_n)
    regimes = by_regime(trip.desired_n, trip.force_n, regimes_of(validation, yield_travel_m)[trip.sample])
    wanted = context.settings.train_inverse.viscous
    viscous = emulate_viscous(
        inverse, forward, training, limit, wanted.frequency_hz, wanted.amplitude_m, wanted.damping_n_s_m
    )
    context.report.text(
        f"Round trip force to drive to force: NRMSE {pooled.nrmse:.4f}, post-yield {regimes['post_yield'].nrmse:.4f}. "
        f"Viscous damping of {viscous.damping_n_s_m:.0f} N s/m at {viscous.frequency_hz:g} Hz is emulated with NRMSE "
        f"{viscous.figures.nrmse:.3f}, and {viscous.fast.nrmse:.3f} at more than half the peak velocity."
    )
    if viscous.outside_training_range > 0.01:
        context.warn(
            f"the viscous damping to be emulated lies {100 * viscous.outside_training_range:.1f} % of the time "
            "outside the training range: lower train_inverse.viscous.amplitude_m, frequency_hz or damping_n_s_m"
        )
    context.report.figure(
        "viscous",
        figures.viscous_emulation(viscous, training.drive_unit),
        "Pure viscous damping emulated by inverse and forward network (thesis Figure 2.24).",
    )
    return {
        "round_trip_nrmse": pooled.nrmse,
        "round_trip_regime_nrmse": {name: item.nrmse for name, item in regimes.items()},
        "viscous_nrmse": viscous.figures.nrmse,
        "viscous_fast_nrmse": viscous.fast.nrmse,
        "viscous_damping_n_s_m": viscous.damping_n_s_m,
        "viscous_negative_drive_share": viscous.negative_share,
        "viscous_outside_training_range_share": viscous.outside_training_range,
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
