"""`reproduce`: the results and statements of the thesis, recomputed from the run and compared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.thesis.bench import Bench
    from mrpipe.thesis.chapter6 import CaseOptions

LAWS = ("vd", "vdps", "vdns", "fdns")
READ = (
    "prepare",
    "assemble",
    "sweep",
    "train-forward",
    "train-inverse",
    "identify-damper",
    "identify-frame",
    "calibrate",
    "close-loop",
    *(f"simulate-{law}" for law in LAWS),
)
"""Stages of a run that the ledger reads."""


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.structures import frame_from_parameter_set
    from mrpipe.thesis import build_ledger, page

    settings = context.settings.reproduce
    printed = frame_from_parameter_set(settings.frame)
    ledger = build_ledger(_bench(context), printed, _case_options(context), tuple(settings.chapters), context.progress)
    claims = ledger.claims
    with context.write("reproduce.h5") as artifact:
        artifact.put_json("claims", [claim.as_dict() for claim in claims])
        artifact.put("deviation", page.deviations(claims), unit="1", dims=("claim",))
    atomic_write_text(context.run_directory / "reproduce.md", page.markdown(ledger))
    page.describe(context.report, ledger)
    return {
        "claims": [claim.as_dict() for claim in claims],
        "counts": page.counts(claims),
        "counts_by_kind": page.counts_by_kind(claims),
        "counts_by_table": page.counts_by_table(claims),
    }


def _bench(context: StageContext) -> Bench:
    from mrpipe.structures import frame_from_parameter_set
    from mrpipe.thesis.bench import bench_of_run, bench_of_sets

    if context.settings.reproduce.source == "sets":
        return bench_of_sets(frame_from_parameter_set(context.settings.reproduce.frame))
    artifacts = {name: context.artifact(name) for name in context.inputs}
    return bench_of_run(context.settings.simulate, artifacts, context.seed)


def _case_options(context: StageContext) -> CaseOptions:
    from mrpipe.thesis.chapter6 import CaseOptions

    settings = context.settings.benchmark
    isolated, wind = settings.base_isolated, settings.wind
    return CaseOptions(
        isolation_damping_ratio=isolated.damping_ratio,
        isolation_stiffness_share=isolated.stiffness_share,
        isolation_lqg=isolated.lqg,
        wind_stiffness_share=wind.stiffness_share,
        wind_lqg=wind.lqg,
        wind_modes=wind.modes,
        tuned_mass_kg=wind.tuned_mass_kg,
        climate=wind.load,
        wind_duration_s=wind.load.duration_s,
        wind_interval_s=wind.load.synthetic_interval_s,
        filter_rate=wind.filter_rate_1_s,
    )


STAGE = Stage(
    name="reproduce",
    summary="Recompute the results of the thesis, and give a verdict for each.",
    run=_run,
    conditional_inputs=tuple(("reproduce.source", "run", name) for name in READ),
    settings=("reproduce", "simulate", "benchmark"),
    after=("benchmark", "close-loop"),
    outputs=("reproduce.h5", "reproduce.md"),
    public_data=("ground_motions", "asce_base_isolated", "tall76"),
)
