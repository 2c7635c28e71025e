"""`record-bench`, `record-frame`, `record-closed-loop`: the virtual laboratory writes campaigns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    import numpy as np

    from mrpipe.laboratory.damper import TrueDamper
    from mrpipe.laboratory.effects import Planted
    from mrpipe.laboratory.frame_rig import TableRecord
    from mrpipe.laboratory.motion import BenchTest
    from mrpipe.laboratory.options import BenchRig
    from mrpipe.laboratory.structure import TrueStructure

_DAMPER = (
    "laboratory.damper",
    "laboratory.declared_effects",
    "laboratory.hidden_effects",
    "laboratory.draw_hidden_share",
    "laboratory.vary_damper",
)


def _true_damper(context: StageContext) -> TrueDamper:
    """Return the damper of the settings, which is the same for all stages that record a rig."""
    import numpy as np

    from mrpipe.laboratory.damper import damper_from_set, draw_damper
    from mrpipe.laboratory.effects import Planted, draw_hidden_effect, find_form

    settings = context.settings.laboratory
    rng = np.random.default_rng([context.seed, 41])
    damper = damper_from_set(settings.damper)
    if settings.vary_damper > 0.0:
        damper = draw_damper(rng, damper, settings.vary_damper)
    effects = [
        Planted(find_form(item.name, item.form), item.parameters, item.strength_share, declared)
        for declared, items in ((True, settings.declared_effects), (False, settings.hidden_effects))
        for item in items
    ]
    if settings.draw_hidden_share is not None:
        effects.append(draw_hidden_effect(rng, share=settings.draw_hidden_share))
    return damper.with_effects(effects)


def _bench_order(context: StageContext) -> tuple[list[BenchTest], BenchRig, np.random.Generator]:
    """Return the tests, the machine and the generator of the bench; the shaking table uses the same damper."""
    import numpy as np

    from mrpipe.laboratory.motion import BenchTest
    from mrpipe.laboratory.plans import tests_of

    bench = context.settings.laboratory.bench
    listed = [] if bench.plan == "custom" else tests_of(bench.plan, cycles=bench.cycles, duration_s=bench.short_test_s)
    tests = [*listed, *(BenchTest(**item.model_dump()) for item in bench.tests)]
    return tests, bench, np.random.default_rng([context.seed, 47])


def _record_bench(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.laboratory.bench import record_bench
    from mrpipe.laboratory.blind import write_bench

    bench = context.settings.laboratory.bench
    tests, rig, rng = _bench_order(context)
    record = record_bench(_true_damper(context), tests, rig, rng, context.progress, context.jobs)
    declared = [item.name for item in record.damper.effects if item.declared]
    final = context.run_directory / "campaigns" / "bench"
    write_bench(final, record, rig, plan=bench.plan, data_format=bench.data_format)
    return _summary(context, "campaigns/bench", record.tests, declared, rig.sampling_rate_hz)


def _true_structure(context: StageContext) -> TrueStructure:
    """Return the structure of the settings."""
    import numpy as np

    from mrpipe.laboratory.effects import Planted
    from mrpipe.laboratory.frame_rig import calibrated_structure
    from mrpipe.laboratory.structure import TrueStructure, find_frame_form, random_frame
    from mrpipe.structures import frame_from_parameter_set

    settings = context.settings.laboratory.frame
    if settings.random_floors:
        frame = random_frame(np.random.default_rng([context.seed, 43]), settings.random_floors)
    else:
        frame = frame_from_parameter_set(settings.structure)
    effects = [
        Planted(find_frame_form(item.name, item.form), item.parameters, item.strength_share, declared)
        for declared, items in ((True, settings.declared_effects), (False, settings.hidden_effects))
        for item in items
    ]
    structure = TrueStructure(frame, tuple(effects))
    return calibrated_structure(structure, settings)


def _record_frame(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.laboratory.frame_rig import record_frame

    rig = context.settings.laboratory.frame
    structure = _true_structure(context)
    record = record_frame(structure, rig, context.rng, context.progress)
    return _write_table(context, "frame", record, structure, structure.effects, rig.sampling_rate_hz)


def _record_closed_loop(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.control.assembly import ControllerFactory, inverse_network
    from mrpipe.control.storage import read_calibrated
    from mrpipe.dampers.model import read_damper
    from mrpipe.laboratory.bench import calibrated_on
    from mrpipe.laboratory.closed_loop import record_closed_loop
    from mrpipe.structures import read_frame

    rig = context.settings.laboratory.closed_loop
    damper, structure = calibrated_on(_true_damper(context), *_bench_order(context)), _true_structure(context)
    frame, model = read_frame(context.artifact("identify-frame")), read_damper(context.artifact("identify-damper"))
    chosen = context.settings.simulate.controller
    factory = ControllerFactory(
        frame,
        model,
        read_calibrated(context.artifact("calibrate")),
        chosen,
        inverse_network(chosen, lambda: context.artifact("train-inverse")),
    )
    controllers = {law: factory.build(law) for law in rig.laws}
    record = record_closed_loop(damper, structure, controllers, rig, context.rng, context.progress)
    effects = (*damper.effects, *structure.effects)
    summary = _write_table(context, "closed-loop", record, structure, effects, rig.sampling_rate_hz)
    return {**summary, "laws": list(rig.laws)}


def _write_table(
    context: StageContext,
    name: str,
    record: TableRecord,
    structure: TrueStructure,
    effects: Sequence[Planted],
    rate_hz: float,
) -> dict[str, Any]:
    """Write a recording of the shaking table as a campaign, and its truth next to it; return the summary."""
    from mrpipe.campaigns import write_campaign
    from mrpipe.laboratory.frame_rig import floor_masses
    from mrpipe.laboratory.sealing import campaign_directory, write_scales, write_sealed

    declared = [item.name for item in effects if item.declared]
    final = context.run_directory / "campaigns" / name
    with campaign_directory(final) as folder:
        write_campaign(
            folder,
            campaign=f"virtual-{name}",
            rig="shear-frame",
            sampling_rate_hz=rate_hz,
            channels=record.channels,
            tests=record.tests,
            extra={"declared_effects": declared, "frame": {"floor_masses_kg": floor_masses(structure)}},
        )
        write_scales(folder, record.scales)
        write_sealed(final, record.truth)
    return _summary(context, f"campaigns/{name}", record.tests, declared, rate_hz)


def _summary(
    context: StageContext, campaign: str, tests: list[Any], declared: list[str], rate: float
) -> dict[str, Any]:
    """Return the summary of a recorded campaign; it never contains the truth."""
    from mrpipe.reporting import record as section

    rows = [(test.name, test.role, len(next(iter(test.columns.values())))) for test in tests]
    samples = sum(count for _, _, count in rows)
    roles = [test.role for test in tests]
    section.describe(context.report, section.RecordedCampaign(campaign, rows, declared, rate))
    return {
        "campaign": campaign,
        "tests": len(tests),
        "roles": {role: roles.count(role) for role in dict.fromkeys(roles)},
        "samples": samples,
        "duration_s": samples / rate,
        "sampling_rate_hz": rate,
        "declared_effects": declared,
    }


RECORD_BENCH = Stage(
    name="record-bench",
    summary="Record a damper campaign on the virtual bench.",
    family="record",
    run=_record_bench,
    settings=(*_DAMPER, "laboratory.bench"),
    outputs=("campaigns/bench",),
)
RECORD_FRAME = Stage(
    name="record-frame",
    summary="Record sweeps and free decays of the frame on the virtual shaking table.",
    after=("record-bench",),
    family="record",
    run=_record_frame,
    settings=("laboratory.frame",),
    outputs=("campaigns/frame",),
)
RECORD_CLOSED_LOOP = Stage(
    name="record-closed-loop",
    summary="Record the closed loop under every law on the virtual shaking table.",
    after=("simulate",),
    family="record",
    run=_record_closed_loop,
    inputs=("identify-frame", "identify-damper", "calibrate", "train-inverse"),
    settings=(*_DAMPER, "laboratory.frame", "laboratory.bench", "laboratory.closed_loop", "simulate.controller"),
    outputs=("campaigns/closed-loop",),
)
STAGES = (RECORD_BENCH, RECORD_FRAME, RECORD_CLOSED_LOOP)
