"""`prepare`: filters and differentiates recordings, removes offsets, and finds steady cycles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.campaigns.plausibility import judge
    from mrpipe.reporting import prepare as section
    from mrpipe.signals.preparation import prepare_campaign
    from mrpipe.signals.prepared import write_prepared
    from mrpipe.signals.summary import preparation_row, summarised

    settings = context.settings.prepare
    campaign = load_campaign(context.inputs["campaign:bench"])
    for finding in (*campaign.findings, *(item.line for item in judge(campaign))):
        context.warn(finding)
    prepared = prepare_campaign(campaign, settings, context.progress)
    preparations = prepared.tests
    for finding in prepared.findings:
        context.warn(finding)
    for line in summarised([(item.test.name, line) for item in preparations for line in item.findings]):
        context.warn(line)
    rows = [preparation_row(item) for item in preparations]
    with context.write("prepared.h5") as artifact:
        write_prepared(artifact, [item.test for item in preparations])
        artifact.put_json("campaign", {"name": campaign.name, "findings": list(context.warnings)})
        artifact.put_json("preparation", rows)
    section.describe(context.report, section.PreparedCampaign(campaign, preparations, rows))
    return {
        "campaign": campaign.name,
        "test_count": len(preparations),
        "sampling_rate_hz": preparations[0].test.sampling_rate_hz,
        "drive_unit": campaign.drive_unit,
        "drive_is_set_point": campaign.drive_is_set_point,
        "differentiation": settings.differentiation,
        "phase": settings.phase,
        "findings": list(context.warnings),
        "tests": rows,
    }


STAGE = Stage(
    name="prepare",
    summary="Filter the measured tests, remove offsets, differentiate, and find the steady cycles.",
    run=_run,
    inputs=("campaign:bench",),
    after=("record-frame",),
    settings=("prepare",),
    outputs=("prepared.h5",),
)
