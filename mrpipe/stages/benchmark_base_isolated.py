"""`benchmark base-isolated`: the base-isolated building."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.pipeline.stage import Stage, StageContext


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.case_studies.base_isolated import report
    from mrpipe.case_studies.base_isolated import study as bench
    from mrpipe.case_studies.base_isolated.structure import building_of
    from mrpipe.case_studies.inverse import neural_inverse
    from mrpipe.case_studies.laws import require_known
    from mrpipe.case_studies.motion import SEVEN_MOTIONS, load_motion, motion_facts, motion_from_settings
    from mrpipe.case_studies.run import bingham_device
    from mrpipe.case_studies.storage import write_cases
    from mrpipe.thesis.entries import printed_columns

    settings = context.settings.benchmark.base_isolated
    require_known(settings.laws, bench.STRUCTURE)
    device = bingham_device(settings.damper)
    building = building_of(
        settings.model,
        settings.surrogate,
        bearing_stiffness=settings.bearing_stiffness_n_m,
        bearing_viscosity=settings.bearing_viscosity_n_s_m,
    )
    motion = motion_from_settings(settings.motion, context.rng, 2)
    for note in motion.notes:
        context.log.info("%s: %s", motion.name, note)
    seven = [load_motion(name, context.rng) for name in SEVEN_MOTIONS] if settings.all_motions else []
    inverse = None
    if settings.neural_inverse:
        context.progress(0.05, "neural inverse of the damper")
        inverse = neural_inverse(device, context.rng, hidden=settings.hidden_neurons, jobs=context.jobs)
    study = bench.isolation_study(
        building,
        device=device,
        network=None if inverse is None else inverse.network,
        damping_ratio=settings.damping_ratio,
        stiffness_share=settings.stiffness_share,
        lqg=settings.lqg,
        time_step_s=settings.time_step_s,
    )
    context.progress(0.3, f"{len(settings.laws)} laws")
    free, cases = bench.run_cases(study, motion, settings.laws, context.jobs)
    motions = {}
    if seven:
        context.progress(0.5, "seven motions")
        motions = bench.run_motions(study, seven, settings.laws, context.jobs)
    law = settings.laws[0]
    context.progress(0.8, "sensitivity to damper capacity")
    sweep = bench.capacity_sensitivity(study, motion, law, settings.dampers)
    result = report.IsolationResult(study, motion, free, cases, motions, law, sweep, inverse)
    printed = printed_columns("Table 6.2", "T6.2")
    summary = report.summary(result, printed)
    with context.write("benchmark-base-isolated.h5") as artifact:
        artifact.put_json("summary", {key: summary[key] for key in ("laws", "motions", "thesis", "sensitivity")})
        write_cases(artifact, building.model, cases)
    report.describe(context.report, result, printed)
    return {**summary, "motion_details": motion_facts(motion)}


STAGE = Stage(
    name="benchmark-base-isolated",
    summary="The base-isolated building under two-component ground motions, two 1000 kN dampers at its base.",
    run=_run,
    settings=("benchmark.base_isolated",),
    after=("close-loop",),
    family="benchmark",
    outputs=("benchmark-base-isolated.h5",),
    public_data=("ground_motions", "asce_base_isolated"),
)
