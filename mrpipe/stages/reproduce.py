"""`reproduce`: the printed figures of the thesis, recomputed and compared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.thesis import collect_claims, page

    claims = collect_claims(context.settings.reproduce, context.progress)
    number = page.counts(claims)
    with context.write("reproduce.h5") as artifact:
        artifact.put_json("claims", [claim.as_dict() for claim in claims])
        artifact.put("deviation", page.deviations(claims), unit="1", dims=("claim",))
    atomic_write_text(context.run_directory / "reproduce.md", page.markdown(claims))
    page.describe(context.report, claims)
    return {"claims": [claim.as_dict() for claim in claims], "counts": number}


STAGE = Stage(
    name="reproduce",
    summary="Recompute the printed figures of the thesis and say which hold.",
    run=_run,
    settings=("reproduce",),
    after=("benchmark",),
    outputs=("reproduce.h5", "reproduce.md"),
    public_data=("ground_motions", "asce_base_isolated", "tall76"),
)
