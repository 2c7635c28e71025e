"""`benchmark ten-storey`: the ten-storey frame of paper P4."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.case_studies.motion import motion_facts, motion_from_settings
    from mrpipe.case_studies.run import bingham_device
    from mrpipe.case_studies.storage import write_cases
    from mrpipe.case_studies.ten_storey import report
    from mrpipe.case_studies.ten_storey import study as bench
    from mrpipe.case_studies.ten_storey.structure import ten_storey
    from mrpipe.effects.damper import damper_named
    from mrpipe.thesis.entries import printed_columns

    settings = context.settings.benchmark.ten_storey
    bench.check_laws(settings.laws)
    device = bingham_device(settings.inverse)
    chain = damper_named(settings.damper, {}).chain()
    # read all files first, so that a mistake in one is reported before a motion is synthesised
    frames = {name: ten_storey(name) for name in settings.structures}
    motion = motion_from_settings(settings.motion, context.rng, 1)
    for note in motion.notes:
        context.log.info("%s: %s", motion.name, note)
    studies = {}
    for index, (name, frame) in enumerate(frames.items()):
        context.progress(index / (len(frames) + 1), name)
        study = bench.ten_storey_study(
            frame,
            motion,
            device=device,
            chain=chain,
            time_step_s=settings.time_step_s,
            filter_rate=settings.filter_rate_1_s,
        )
        studies[name] = (study, study.cases(settings.laws, jobs=context.jobs))
    study, cases = studies[settings.structures[0]]
    sweep = study.sensitivity(settings.laws, settings.dampers, jobs=context.jobs)
    printed = printed_columns("P4 Table 2", "P4-T2")
    summary = report.summary(studies, sweep, printed)
    with context.write("benchmark-ten-storey.h5") as artifact:
        artifact.put_json("summary", {key: summary[key] for key in ("laws", "variants", "thesis")})
        write_cases(artifact, study.model, [case for case in cases if case.variant == "filtered"])
    report.describe(context.report, studies, sweep, printed)
    return {**summary, "motion_details": motion_facts(motion)}


STAGE = Stage(
    name="benchmark-ten-storey",
    summary="The ten-storey frame of paper P4 under a ground motion, one 1000 kN damper at the bottom.",
    run=_run,
    settings=("benchmark.ten_storey",),
    after=("close-loop",),
    family="benchmark",
    outputs=("benchmark-ten-storey.h5",),
    public_data=("ground_motions", "asce_base_isolated"),
)
