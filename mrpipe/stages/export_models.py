"""`export damper`, `frame`, `forward` and `inverse`: a model of the run in the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.exports.contract import Subject

FOLDER = "export"
DAMPERS = {"identified": "identify-damper", "traced": "close-loop"}
"""Dampers of this run by name, and the stage whose artifact holds each."""


def _tracing(context: StageContext) -> Mapping[str, Any]:
    """Return the summary of close-loop, empty if the run has no tracing that is up to date."""
    known = "close-loop" in context.inputs
    return context.artifact("close-loop").json("summary") if known else {}


def _damper(context: StageContext) -> Subject:
    from functools import partial

    from mrpipe.effects.damper import damper_named
    from mrpipe.exports.damper import damper_subject
    from mrpipe.exports.left_out import effects_left_out

    name = context.settings.simulate.damper
    left_out = []
    if name == "identified":
        left_out = effects_left_out(_tracing(context), "plant", "export the traced damper with --damper traced")
    found = damper_named(name, {key: partial(context.artifact, stage) for key, stage in DAMPERS.items()})
    return damper_subject(found, prefix=context.settings.export.prefix, source=name, left_out=left_out)


def _frame(context: StageContext) -> Subject:
    from mrpipe.exports.frame import frame_subject
    from mrpipe.exports.left_out import effects_as_data, frame_left_out
    from mrpipe.structures import floor_position, storey_position
    from mrpipe.structures.over_amplitude import read_frame_at

    settings = context.settings
    artifact, amplitude = context.artifact("identify-frame"), settings.simulate.frame_amplitude_m
    frame = read_frame_at(artifact, amplitude)
    place = storey_position if settings.calibrate.damper_across_storey else floor_position
    position = place(frame.floors, settings.calibrate.damper_floor)
    tracing = _tracing(context)
    return frame_subject(
        frame,
        position,
        prefix=settings.export.prefix,
        rate_hz=settings.export.frame_rate_hz,
        amplitude_m=amplitude,
        left_out=frame_left_out(artifact, amplitude, tracing),
        traced_effects=effects_as_data(tracing, "structure"),
    )


def _network(context: StageContext, name: str) -> Subject:
    from mrpipe.exports.network import network_subject
    from mrpipe.networks.network import read_network

    network = read_network(context.artifact(f"train-{name}"), "network")
    unit = str(context.artifact("assemble").attributes("training")["drive_unit"])
    return network_subject(network, name, context.settings.export.prefix, drive_unit=unit)


def _run(context: StageContext, name: str, subject_of: Callable[[StageContext], Subject]) -> Mapping[str, Any]:
    from mrpipe.exports.library import write_export
    from mrpipe.exports.replaced import replaced_export
    from mrpipe.reporting import export_models as section

    subject = subject_of(context)
    for sentence in subject.left_out:
        context.warn(sentence)
    folder = context.run_directory / FOLDER / name
    if name == "damper" and (replaced := replaced_export(folder, str(subject.details["source"]))):
        context.log.warning("%s: %s", context.stage, replaced)
    files = write_export(subject, folder, context.settings.export.formats)
    section.describe(context.report, subject, files, f"{FOLDER}/{name}")
    source = {"source": subject.details["source"]} if "source" in subject.details else {}
    return {"kind": subject.kind, "name": subject.name, **source, "folder": str(folder), "files": files}


def _check_damper(settings: Any) -> None:
    """Check that the damper is there."""
    from mrpipe.effects.damper import require_damper

    require_damper(settings.simulate.damper, "simulate.damper")


def _stage(
    name: str,
    subject_of: Callable[[StageContext], Subject],
    inputs: tuple[str, ...],
    settings: tuple[str, ...] = (),
    conditional_inputs: tuple[tuple[str, str | None, str], ...] = (),
    known_inputs: tuple[str, ...] = (),
    check: Callable[[Any], None] | None = None,
) -> Stage:
    return Stage(
        name=f"export-{name}",
        summary=f"Write the {name} as C, JSON, ONNX or MATLAB, with test vectors.",
        run=lambda context: _run(context, name, subject_of),
        inputs=inputs,
        conditional_inputs=conditional_inputs,
        known_inputs=known_inputs,
        settings=("export", *settings),
        after=("reproduce",),
        family="export",
        outputs=(f"{FOLDER}/{name}/vectors.csv", f"{FOLDER}/{name}/README.md"),
        check=check,
    )


STAGES = (
    _stage(
        "damper",
        _damper,
        (),
        ("simulate.damper",),
        (
            ("simulate.damper", "identified", "identify-damper"),
            ("simulate.damper", "traced", "identify-damper"),
            ("simulate.damper", "traced", "close-loop"),
        ),
        ("close-loop",),
        _check_damper,
    ),
    _stage(
        "frame",
        _frame,
        ("identify-frame",),
        ("calibrate.damper_floor", "calibrate.damper_across_storey", "simulate.frame_amplitude_m"),
        known_inputs=("close-loop",),
    ),
    _stage("forward", lambda context: _network(context, "forward"), ("assemble", "train-forward")),
    _stage("inverse", lambda context: _network(context, "inverse"), ("assemble", "train-inverse")),
)
