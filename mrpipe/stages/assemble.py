"""`assemble`: builds the training set from prepared tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.errors import UserError
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.artifacts import ArtifactWriter
    from mrpipe.networks.assembly import History
    from mrpipe.networks.network import FeatureSpec


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.networks.assembly import CHANNELS, join, write_history
    from mrpipe.networks.network import FeatureSpec
    from mrpipe.reporting import assemble as section
    from mrpipe.signals.prepared import read_prepared

    settings = context.settings.assemble
    tests = read_prepared(context.artifact("prepare"))
    histories: dict[str, History] = {}
    for role in ("training", "validation"):
        chosen = [test for test in tests if test.role == role]
        if not chosen:
            raise UserError(
                context.inputs["prepare"], "tests", f"no {role} test", f"give role: {role} in campaign.yaml"
            )
        rates = sorted({test.sampling_rate_hz for test in chosen})
        if len(rates) > 1:
            raise UserError(
                context.inputs["prepare"],
                "tests",
                f"rates of {rates} Hz",
                "prepare them at one rate (prepare.working_rate_hz)",
            )
        histories[role] = join(chosen, cycles=settings.cycles, sampling_rate_hz=settings.sampling_rate_hz)
        context.progress(0.4 if role == "training" else 0.6, f"{role}: {histories[role].samples} samples")
    rate = histories["training"].sampling_rate_hz
    specs = {
        "forward": FeatureSpec(
            tuple(settings.forward_inputs), settings.past_values, False, rate, "force", settings.forward_past_force
        ),
        "inverse": FeatureSpec(
            tuple(settings.inverse_inputs), settings.past_values, settings.inverse_absolute, rate, "drive"
        ),
    }
    with context.write("training.h5") as artifact:
        for role, history in histories.items():
            write_history(artifact, role, history)
        for name, spec in specs.items():
            _write_rows(artifact, name, spec, histories, settings.normalisation)
        artifact.attributes("/", normalisation=settings.normalisation)
    training = histories["training"]
    jumps = {name: training.largest_jump(name) for name in CHANNELS}
    section.describe(context.report, section.TrainingSet(training, histories["validation"], jumps))
    return {
        "training_tests": len(training.names),
        "validation_tests": len(histories["validation"].names),
        "training_samples": training.samples,
        "validation_samples": histories["validation"].samples,
        "sampling_rate_hz": rate,
        "past_values": settings.past_values,
        "forward_features": list(specs["forward"].labels),
        "inverse_features": list(specs["inverse"].labels),
        "largest_jump_at_joins": jumps,
    }


def _write_rows(
    artifact: ArtifactWriter, name: str, spec: FeatureSpec, histories: Mapping[str, History], normalisation: Any
) -> None:
    """Store lagged features, targets and normalisation of one network."""
    from mrpipe.networks.assembly import samples
    from mrpipe.networks.network import CHANNEL_UNITS, spec_to_json
    from mrpipe.networks.scaling import scaling_of

    artifact.put_json(f"{name}/features", spec_to_json(spec))
    unit = CHANNEL_UNITS.get(spec.target, histories["training"].drive_unit)
    for role, history in histories.items():
        rows = samples(history, spec)
        artifact.put(f"{name}/{role}/features", rows.features, unit="SI of each feature", dims=("row", "feature"))
        artifact.put(f"{name}/{role}/target", rows.target, unit=unit, dims=("row",))
        artifact.put(f"{name}/{role}/test", rows.test, unit="1", dims=("row",))
        if role == "training":
            scaling = scaling_of(rows.features, rows.target, spec, normalisation)
            for key in ("input_scale", "input_shift"):
                artifact.put(f"{name}/{key}", getattr(scaling, key), unit="SI of each feature", dims=("feature",))
            for key in ("output_scale", "output_shift"):
                artifact.put(f"{name}/{key}", getattr(scaling, key), unit=unit)


STAGE = Stage(
    name="assemble",
    summary="Build the training set: steady cycles joined at zero crossings, decimated, with past values.",
    run=_run,
    inputs=("prepare",),
    settings=("assemble",),
    outputs=("training.h5",),
)
