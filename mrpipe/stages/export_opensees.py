"""`export opensees`: the structure as an openseespy script."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext

FILE = "opensees-model.py"


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.exports.left_out import dampers_left_out, frame_left_out
    from mrpipe.structures.opensees import opensees_script
    from mrpipe.structures.over_amplitude import read_frame_at

    artifact, amplitude = context.artifact("identify-frame"), context.settings.simulate.frame_amplitude_m
    frame = read_frame_at(artifact, amplitude)
    tracing = context.artifact("close-loop").json("summary") if "close-loop" in context.inputs else {}
    left_out = frame_left_out(artifact, amplitude, tracing) + dampers_left_out(context.settings.structure.dampers)
    for sentence in left_out:
        context.warn(sentence)
    path = context.run_directory / FILE
    atomic_write_text(path, opensees_script(frame, notes=left_out))
    context.report.text(
        f"The structure as an openseespy script: {FILE}. Run it, or import `build` and `shake` from it."
    )
    return {"file": str(path), "degrees_of_freedom": list(frame.names), "left_out": left_out}


STAGE = Stage(
    name="export-opensees",
    summary="Write the structure as an openseespy script.",
    run=_run,
    inputs=("identify-frame",),
    known_inputs=("close-loop",),
    settings=("structure", "simulate.frame_amplitude_m"),
    after=("export-controller",),
    family="export",
    outputs=(FILE,),
)
