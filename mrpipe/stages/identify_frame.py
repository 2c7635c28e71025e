"""`identify-frame`: mass, damping, stiffness and modes of a frame from forced, ambient and decay tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.modal.identification import GivenShapes
    from mrpipe.modal.options import IdentificationOptions


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.modal.identify import identify_frame
    from mrpipe.modal.recordings import frame_tests
    from mrpipe.modal.storage import summary, write_identification
    from mrpipe.reporting import identify_frame as section

    campaign = load_campaign(context.inputs["campaign:frame"])
    for finding in campaign.findings:
        context.warn(finding)
    options, shapes = _options(context)
    result = identify_frame(frame_tests(campaign), options, context.progress, shapes)
    for finding in result.findings:
        context.warn(finding)
    with context.write("frame.h5") as artifact:
        write_identification(artifact, result)
    values = summary(result)
    segment_s = context.settings.identify_frame.segment_s
    section.describe(context.report, section.IdentifiedFrame(result, values, segment_s))
    return {"campaign": campaign.name, **values}


def _options(context: StageContext) -> tuple[IdentificationOptions, GivenShapes | None]:
    from mrpipe.artifacts import load_parameter_set
    from mrpipe.errors import UserError
    from mrpipe.modal.identification import GivenShapes

    settings = context.settings.identify_frame
    if not settings.mode_matrix:
        return settings, None
    values = load_parameter_set("frames", settings.mode_matrix).values
    if "mode_shapes" not in values:
        raise UserError(f"frame {settings.mode_matrix}", "parameters.mode_shapes", "is missing", "give value and unit")
    return settings, GivenShapes(values["mode_shapes"], settings.mode_matrix)


STAGE = Stage(
    name="identify-frame",
    summary="Identify mass, damping, stiffness and modes of the frame.",
    run=_run,
    inputs=("campaign:frame",),
    after=("identify-damper",),
    settings=("identify_frame",),
    outputs=("frame.h5",),
)
