"""`benchmark NAME`: the ten-storey frame, the base-isolated building and the tall building in wind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.case_studies.inverse import ValidatedInverse
    from mrpipe.case_studies.run import BinghamDevice, Response
    from mrpipe.case_studies.wind.load import WindLoad
    from mrpipe.structures.records import GroundMotion


def _motion(context: StageContext, settings: Any, components: int) -> GroundMotion:
    from mrpipe.case_studies.motion import load_motion

    motion = load_motion(
        settings.file,
        context.rng,
        second_file=settings.second_file,
        unit=settings.unit,
        interval_s=settings.interval_s,
        resampled_interval_s=settings.resampled_interval_s,
        peak_ground_g=settings.peak_ground_g,
        duration_s=settings.duration_s,
    ).in_components(components)
    for note in motion.notes:
        context.log.info("%s: %s", motion.name, note)
    return motion


def _motion_summary(motion: GroundMotion) -> dict[str, Any]:
    return {
        "name": motion.name,
        "peaks_m_s2": motion.peaks_m_s2,
        "duration_s": motion.duration_s,
        "interval_s": motion.interval_s,
        "unit_in_file": motion.unit,
        "unit_from": motion.unit_from,
        "notes": list(motion.notes),
    }


def _bingham(name: str) -> BinghamDevice:
    from mrpipe.artifacts import load_parameter_set
    from mrpipe.case_studies.run import BinghamDevice

    values = load_parameter_set("dampers", name)
    parts = ("yield_force_a", "yield_force_b", "c0_a", "c0_b", "drive_limit")
    return BinghamDevice(*(values.scalar(part) for part in parts))


def _write_response(artifact: Any, group: str, response: Response) -> None:
    """Store the device's histories of a run."""
    artifact.put(f"{group}/time", response.time_s, unit="s", dims=("time",))
    entries = {
        "stroke": (response.stroke(), "m"),
        "rod_velocity": (response.rod_velocity(), "m/s"),
        "force": (response.forces, "N"),
        "desired_force": (response.desired, "N"),
        "voltage": (response.voltages, "V"),
    }
    for name, (values, unit) in entries.items():
        artifact.put(f"{group}/{name}", values, unit=unit, dims=("time", "device"))
    artifact.put(f"{group}/energies", response.energies, unit="J", dims=("time", "input_damping_devices"))


def _ten_storey(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.case_studies.ten_storey import report
    from mrpipe.case_studies.ten_storey import study as bench
    from mrpipe.case_studies.ten_storey.structure import ten_storey
    from mrpipe.effects.damper import damper_named
    from mrpipe.thesis.entries import printed_columns

    settings = context.settings.benchmark.ten_storey
    bench.check_laws(settings.laws)
    device = _bingham(settings.inverse)
    chain = damper_named(settings.damper, {}).chain()
    # read all files first, so that a mistake in one is reported before a motion is synthesised
    frames = {name: ten_storey(name) for name in settings.structures}
    motion = _motion(context, settings.motion, 1)
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
        for case in cases:
            if case.variant == "filtered":
                _write_response(artifact, f"responses/{case.law}", case.response)
        artifact.attributes("/", model=study.model.origin, source=study.model.source)
    report.describe(context.report, studies, sweep, printed)
    return {**summary, "motion_details": _motion_summary(motion)}


def _neural_inverse(context: StageContext, device: BinghamDevice, settings: Any) -> ValidatedInverse | None:
    """Train and validate the inverse network of the damper; return None if the settings use the formula."""
    from mrpipe.case_studies.inverse import train_inverse, validated_inverse

    if not settings.neural_inverse:
        return None
    context.progress(0.05, "neural inverse of the damper")
    trained = train_inverse(device, context.rng, hidden=settings.hidden_neurons, jobs=context.jobs)
    return validated_inverse(device, trained)


def _base_isolated(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.case_studies.base_isolated import report
    from mrpipe.case_studies.base_isolated import study as bench
    from mrpipe.case_studies.base_isolated.structure import building_of
    from mrpipe.case_studies.laws import require_known
    from mrpipe.case_studies.motion import SEVEN_MOTIONS, load_motion
    from mrpipe.thesis.entries import printed_columns

    settings = context.settings.benchmark.base_isolated
    require_known(settings.laws, bench.STRUCTURE)
    device = _bingham(settings.damper)
    building = building_of(
        settings.model,
        settings.surrogate,
        bearing_stiffness=settings.bearing_stiffness_n_m,
        bearing_viscosity=settings.bearing_viscosity_n_s_m,
    )
    motion = _motion(context, settings.motion, 2)
    seven = [load_motion(name, context.rng) for name in SEVEN_MOTIONS] if settings.all_motions else []
    inverse = _neural_inverse(context, device, settings)
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
        for case in cases:
            _write_response(artifact, f"responses/{case.law}", case.response)
        artifact.attributes("/", model=building.model.origin, source=building.model.source)
    report.describe(context.report, result, printed)
    return {**summary, "motion_details": _motion_summary(motion)}


def _wind_load(context: StageContext, settings: Any) -> WindLoad:
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


def _wind(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.case_studies.laws import require_known
    from mrpipe.case_studies.wind import report
    from mrpipe.case_studies.wind import study as bench
    from mrpipe.case_studies.wind.structure import DEFAULT_CAPACITIES, DEFAULT_DAMPERS, place_device, tower_of
    from mrpipe.thesis.entries import printed_columns

    settings = context.settings.benchmark.wind
    require_known(settings.laws, bench.STRUCTURE)
    device = _bingham(settings.damper)
    reference = tower_of(settings.model, settings.surrogate)
    load = _wind_load(context, settings.load)
    tower = place_device(
        reference,
        settings.position,
        floor=settings.outrigger_floor,
        arm_m=settings.outrigger_arm_m,
        mass_kg=settings.tuned_mass_kg,
        frequency_ratio=settings.tuned_frequency_ratio,
    )
    inverse = _neural_inverse(context, device, settings)
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
        for case in cases:
            _write_response(artifact, f"responses/{case.law}", case.response)
        artifact.attributes("/", model=tower.model.origin, source=tower.model.source)
    report.describe(context.report, result, printed)
    return summary


STAGES = (
    Stage(
        name="benchmark-ten-storey",
        summary="The ten-storey frame of paper P4 under a ground motion, one 1000 kN damper at the bottom.",
        run=_ten_storey,
        settings=("benchmark.ten_storey",),
        after=("close-loop",),
        family="benchmark",
        outputs=("benchmark-ten-storey.h5",),
        public_data=("ground_motions", "asce_base_isolated"),
    ),
    Stage(
        name="benchmark-base-isolated",
        summary="The base-isolated building under two-component ground motions, two 1000 kN dampers at its base.",
        run=_base_isolated,
        settings=("benchmark.base_isolated",),
        after=("close-loop",),
        family="benchmark",
        outputs=("benchmark-base-isolated.h5",),
        public_data=("ground_motions", "asce_base_isolated"),
    ),
    Stage(
        name="benchmark-wind",
        summary="The 76-storey tower in across-wind, dampers at the ground, on an outrigger or at a tuned mass.",
        run=_wind,
        settings=("benchmark.wind",),
        after=("close-loop",),
        family="benchmark",
        outputs=("benchmark-wind.h5",),
        public_data=("tall76",),
    ),
)
