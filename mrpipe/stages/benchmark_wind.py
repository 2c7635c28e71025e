"""`benchmark wind`: the tall building in wind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.case_studies.wind.load import WindLoad


def _load(context: StageContext, settings: Any) -> WindLoad:
    from pathlib import Path

    from mrpipe.case_studies.wind.load import read_wind, synthetic_wind
    from mrpipe.case_studies.wind.structure import FLOORS, HEIGHT_M, WIDTH_M

    if settings.file != "synthetic":
        return read_wind(Path(settings.file), FLOORS, unit=settings.unit, interval_s=settings.interval_s)
    return synthetic_wind(
        context.rng,
        FLOORS,
        HEIGHT_M,
        WIDTH_M,
        duration_s=settings.duration_s,
        interval_s=settings.synthetic_interval_s,
        climate=settings,
    )


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.case_studies.inverse import neural_inverse
    from mrpipe.case_studies.laws import require_known
    from mrpipe.case_studies.run import bingham_device
    from mrpipe.case_studies.storage import write_cases
    from mrpipe.case_studies.wind import report
    from mrpipe.case_studies.wind import study as bench
    from mrpipe.case_studies.wind.structure import DEFAULT_CAPACITIES, DEFAULT_DAMPERS, place_device, tower_of
    from mrpipe.thesis.entries import printed_columns

    settings = context.settings.benchmark.wind
    require_known(settings.laws, bench.STRUCTURE)
    device = bingham_device(settings.damper)
    reference = tower_of(settings.model, settings.surrogate)
    load = _load(context, settings.load)
    tower = place_device(
        reference,
        settings.position,
        floor=settings.outrigger_floor,
        arm_m=settings.outrigger_arm_m,
        mass_kg=settings.tuned_mass_kg,
        frequency_ratio=settings.tuned_frequency_ratio,
    )
    inverse = None
    if settings.neural_inverse:
        context.progress(0.05, "neural inverse of the damper")
        inverse = neural_inverse(device, context.rng, hidden=settings.hidden_neurons, jobs=context.jobs)
    study = bench.wind_study(
        reference,
        tower,
        load,
        device=device,
        network=None if inverse is None else inverse.network,
        stiffness_share=settings.stiffness_share,
        tuned_mass_kg=settings.tuned_mass_kg,
        lqg=settings.lqg,
        modes=settings.modes,
        time_step_s=settings.time_step_s,
        dampers=settings.dampers or DEFAULT_DAMPERS[settings.position],
        filter_rate=settings.filter_rate_1_s,
    )
    context.progress(0.2, f"{len(settings.laws)} laws")
    cases = bench.run_wind_cases(study, settings.laws, context.jobs)
    context.progress(0.7, "sensitivity to damper capacity")
    law = settings.laws[0]
    multiples = settings.capacities or DEFAULT_CAPACITIES[settings.position]
    sweep = bench.wind_sensitivity(study, law, [study.dampers * item for item in multiples], context.jobs)
    result = report.WindResult(study, cases, law, sweep, inverse)
    printed = printed_columns("Table 6.3", "T6.3")
    summary = report.summary(result, printed)
    with context.write("benchmark-wind.h5") as artifact:
        artifact.put_json("summary", {key: summary[key] for key in ("laws", "thesis", "sensitivity")})
        write_cases(artifact, tower.model, cases)
    report.describe(context.report, result, printed)
    return summary


STAGE = Stage(
    name="benchmark-wind",
    summary="The 76-storey tower in across-wind, dampers at the ground, on an outrigger or at a tuned mass.",
    run=_run,
    settings=("benchmark.wind",),
    after=("close-loop",),
    family="benchmark",
    outputs=("benchmark-wind.h5",),
    public_data=("tall76",),
)
