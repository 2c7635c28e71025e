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


def _damper(context: StageContext) -> Subject:
    from functools import partial

    from mrpipe.effects.damper import damper_named
    from mrpipe.exports.damper import damper_subject

    name = context.settings.simulate.damper
    found = damper_named(name, {key: partial(context.artifact, stage) for key, stage in DAMPERS.items()})
    return damper_subject(found, prefix=context.settings.export.prefix, source=name)


def _frame(context: StageContext) -> Subject:
    from mrpipe.exports.frame import frame_subject
    from mrpipe.structures import floor_position, read_frame, storey_position

    settings = context.settings
    frame = read_frame(context.artifact("identify-frame"))
    place = storey_position if settings.calibrate.damper_across_storey else floor_position
    position = place(frame.floors, settings.calibrate.damper_floor)
    return frame_subject(frame, position, prefix=settings.export.prefix, rate_hz=settings.export.frame_rate_hz)


def _network(context: StageContext, name: str) -> Subject:
    from mrpipe.exports.network import network_subject
    from mrpipe.networks.network import read_network

    network = read_network(context.artifact(f"train-{name}"), "network")
    unit = str(context.artifact("assemble").attributes("training")["drive_unit"])
    return network_subject(network, name, context.settings.export.prefix, drive_unit=unit)


def _run(context: StageContext, name: str, subject_of: Callable[[StageContext], Subject]) -> Mapping[str, Any]:
    from mrpipe.exports.library import write_export
    from mrpipe.reporting import export_models as section

    subject = subject_of(context)
    folder = context.run_directory / FOLDER / name
    files = write_export(subject, folder, context.settings.export.formats)
    section.describe(context.report, subject, files, f"{FOLDER}/{name}")
    return {"kind": subject.kind, "name": subject.name, "folder": str(folder), "files": files}


def _stage(
    name: str,
    subject_of: Callable[[StageContext], Subject],
    inputs: tuple[str, ...],
    settings: tuple[str, ...] = (),
    conditional_inputs: tuple[tuple[str, str | None, str], ...] = (),
) -> Stage:
    return Stage(
        name=f"export-{name}",
        summary=f"Write the {name} as C, JSON, ONNX or MATLAB, with test vectors.",
        run=lambda context: _run(context, name, subject_of),
        inputs=inputs,
        conditional_inputs=conditional_inputs,
        settings=("export", *settings),
        after=("reproduce",),
        family="export",
        outputs=(f"{FOLDER}/{name}/vectors.csv", f"{FOLDER}/{name}/README.md"),
    )


STAGES = (
    _stage(
        "damper", _damper, ("identify-damper",), ("simulate.damper",), (("simulate.damper", "traced", "close-loop"),)
    ),
    _stage("frame", _frame, ("identify-frame",), ("calibrate.damper_floor", "calibrate.damper_across_storey")),
    _stage("forward", lambda context: _network(context, "forward"), ("assemble", "train-forward")),
    _stage("inverse", lambda context: _network(context, "inverse"), ("assemble", "train-inverse")),
)
