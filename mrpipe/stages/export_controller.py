"""`export controller [--law LAW]`: calibrated controllers as C and JSON for a real-time target.

Without a law, the controller of the setting `export.law` is written to `controller/`. Each law that is named has its
own stage and its own folder `controller/LAW/`, so that the export of one law does not remove that of another.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from mrpipe.control.laws import law_names
from mrpipe.pipeline.loop_inputs import LOOP_INPUTS
from mrpipe.pipeline.stage import Stage, StageContext

FOLDER = "controller"
DAMPERS = {"identified": "identify-damper", "traced": "close-loop"}
"""Dampers of this run by name, and the stage whose artifact contains each."""


FILES = ("controller.json", "controller.c", "controller.h", "self_test.c", "vectors.csv", "README.md")


def export_stage(law: str = "") -> Stage:
    """Return the stage that writes the controller of a law; that of `export.law` if none is named."""
    folder = f"{FOLDER}/{law}" if law else FOLDER
    return Stage(
        name=f"export-controller-{law}" if law else "export-controller",
        summary=f"Write the calibrated controller{f' {law}' if law else ''} as C and JSON, with test vectors.",
        run=lambda context: _run(context, law or context.settings.export.law, folder),
        inputs=("identify-frame", "calibrate"),
        conditional_inputs=(*LOOP_INPUTS, ("gains.source", "design", "design")),
        settings=(
            "gains",
            "export.prefix" if law else "export",
            "simulate.controller",
            "simulate.damper",
            "simulate.frame_amplitude_m",
        ),
        after=("identify-damper", "train-inverse", "reproduce"),
        family="export",
        outputs=tuple(f"{folder}/{name}" for name in FILES),
        check=_check,
    )


def _run(context: StageContext, law: str, place: str) -> Mapping[str, Any]:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.control.assembly import ControllerFactory, inverse_network
    from mrpipe.control.storage import read_calibrated_with
    from mrpipe.effects.damper import damper_named
    from mrpipe.exports.controller import controller_files
    from mrpipe.exports.replaced import replaced_export
    from mrpipe.reporting import export_controller as section
    from mrpipe.structures.over_amplitude import read_frame_at

    settings = context.settings.export
    # the observer of a law contains the frame that was simulated
    frame = read_frame_at(context.artifact("identify-frame"), context.settings.simulate.frame_amplitude_m)
    damper = damper_named(
        context.settings.simulate.damper,
        {name: partial(context.artifact, stage) for name, stage in DAMPERS.items()},
        "simulate.damper",
    )
    chosen = context.settings.simulate.controller
    factory = ControllerFactory(
        frame,
        damper,
        read_calibrated_with(context.artifact, context.settings.gains.source),
        chosen,
        inverse_network(chosen, lambda: context.artifact("train-inverse")),
    )
    built = factory.build(law)
    details: dict[str, Any] = {"drive_unit": damper.drive_unit, "stroke_m": damper.stroke_m}
    details |= {"inverse": chosen.inverse, "damper": context.settings.simulate.damper}
    folder = context.run_directory / place
    if replaced := replaced_export(folder, details["damper"]):
        context.log.warning("%s: %s", context.stage, replaced)
    files = controller_files(built, settings.prefix, details)
    for name, text in files.items():
        atomic_write_text(folder / name, text)
    section.describe(context.report, built, law, place)
    return {
        "law": law,
        "damper": details["damper"],
        "folder": str(folder),
        "files": list(files),
        "sample_time_s": built.sample_time_s,
        "state_size": built.state_size,
    }


def _check(settings: Any) -> None:
    """Check that the damper is there."""
    from mrpipe.effects.damper import require_damper

    require_damper(settings.simulate.damper, "simulate.damper")


STAGE = export_stage()
STAGES = (STAGE, *(export_stage(law) for law in law_names()))
