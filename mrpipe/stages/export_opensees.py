"""`export opensees`: the structure as an openseespy script."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext

FILE = "opensees-model.py"


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.structures import read_frame
    from mrpipe.structures.opensees import opensees_script

    frame = read_frame(context.artifact("identify-frame"))
    path = context.run_directory / FILE
    atomic_write_text(path, opensees_script(frame))
    context.report.text(
        f"The structure as an openseespy script: {FILE}. Run it, or import `build` and `shake` from it."
    )
    return {"file": str(path), "degrees_of_freedom": list(frame.names)}


STAGE = Stage(
    name="export-opensees",
    summary="Write the structure as an openseespy script.",
    run=_run,
    inputs=("identify-frame",),
    settings=("structure",),
    after=("export-controller",),
    family="export",
    outputs=(FILE,),
)
