"""`export controller`: the calibrated controller as C and JSON for a real-time target."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext

FOLDER = "controller"
DAMPERS = {"identified": "identify-damper", "traced": "close-loop"}
"""Dampers of this run by name, and the stage whose artifact holds each."""


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.control.assembly import ControllerFactory, inverse_network
    from mrpipe.control.storage import read_calibrated_with
    from mrpipe.effects.damper import damper_named
    from mrpipe.exports.controller import controller_files
    from mrpipe.reporting import export_controller as section
    from mrpipe.structures import read_frame

    settings = context.settings.export
    frame = read_frame(context.artifact("identify-frame"))
    damper = damper_named(
        context.settings.simulate.damper,
        {name: partial(context.artifact, stage) for name, stage in DAMPERS.items()},
    )
    chosen = context.settings.simulate.controller
    factory = ControllerFactory(
        frame,
        damper,
        read_calibrated_with(context.artifact, context.settings.gains.source),
        chosen,
        inverse_network(chosen, lambda: context.artifact("train-inverse")),
    )
    built = factory.build(settings.law)
    details = {"drive_unit": damper.drive_unit, "stroke_m": damper.stroke_m}
    details["inverse"] = chosen.inverse
    folder = context.run_directory / FOLDER
    files = controller_files(built, settings.prefix, details)
    for name, text in files.items():
        atomic_write_text(folder / name, text)
    section.describe(context.report, built, settings.law, FOLDER)
    return {
        "law": settings.law,
        "folder": str(folder),
        "files": list(files),
        "sample_time_s": built.sample_time_s,
        "state_size": built.state_size,
    }


STAGE = Stage(
    name="export-controller",
    summary="Write the calibrated controller as C and JSON, with test vectors.",
    run=_run,
    inputs=("identify-frame", "identify-damper", "calibrate", "train-inverse"),
    conditional_inputs=(("simulate.damper", "traced", "close-loop"), ("gains.source", "design", "design")),
    settings=("gains", "export", "simulate.controller", "simulate.damper"),
    after=("reproduce",),
    family="export",
    outputs=tuple(
        f"{FOLDER}/{name}"
        for name in ("controller.json", "controller.c", "controller.h", "self_test.c", "vectors.csv", "README.md")
    ),
)
