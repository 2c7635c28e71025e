"""`close-loop`: the residual of the declared model, traced to a missing effect, added, error before and after."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.discrepancy.tracing import Tracing


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.discrepancy.tracing import TracingOptions, trace_campaign
    from mrpipe.discrepancy.verdict import Rules
    from mrpipe.effects.library import damper_effects, effects_named
    from mrpipe.signals.prepared import read_prepared

    settings = context.settings.close_loop
    campaign = load_campaign(context.inputs["campaign:bench"])
    tests = read_prepared(context.artifact("prepare"))
    known = damper_effects()
    declared = [known[name] for name in campaign.declared_effects if name in known]
    for name in campaign.declared_effects:
        if name not in known:
            context.warn(f"the campaign declares {name!r}, which the library does not hold: it is left out")
    options = TracingOptions(
        model=settings.model,
        yield_order=settings.yield_order,
        viscosity_order=settings.viscosity_order,
        most_effects=settings.most_effects,
        fit_rate_hz=settings.fit_rate_hz,
        displacement_cutoff_hz=settings.displacement_cutoff_hz,
        refits=settings.refits,
        folds=settings.folds,
        bootstrap_draws=settings.bootstrap_draws,
        rules=Rules(settings.named_share, settings.least_share, settings.lead),
        record_gain=settings.record_gain,
        observation_filter=settings.observation_filter,
        unattributed=settings.unattributed,
        drive_unit=tests[0].drive_unit or "A",
    )
    library = effects_named(settings.candidates, settings.effect_files)
    traced = trace_campaign(
        tests, library, declared, options, rng=context.rng, jobs=context.jobs, progress=context.progress
    )
    summary = {"campaign": campaign.name, **traced.summary}
    summary["closed_loop"] = _closed_loop(context, traced)
    _write(context, traced, summary)
    _report(context, traced, summary)
    return summary


def _closed_loop(context: StageContext, traced: Tracing) -> dict[str, Any]:
    needed = ("calibrate", "identify-frame")
    lacking = [name for name in needed if name not in context.inputs]
    if lacking:
        reason = f"skipped: no {' and no '.join(lacking)}"
        context.log.info("close-loop: closed-loop part %s", reason)
        return {"status": reason}
    return {"status": "skipped: the closed-loop part needs a calibrated frame", "effects": len(traced.named)}


def _write(context: StageContext, traced: Tracing, summary: Mapping[str, Any]) -> None:
    from mrpipe.artifacts import atomic_write_text

    validation = traced.validation
    with context.write("close-loop.h5") as artifact:
        artifact.put_json("summary", dict(summary))
        for name, values, unit in (
            ("measured", traced.measured, "N"),
            ("before", traced.before, "N"),
            ("after", traced.after, "N"),
            ("displacement", validation.displacement, "m"),
            ("velocity", validation.velocity, "m/s"),
            ("drive", validation.drive, "A"),
            ("time", validation.time, "s"),
        ):
            artifact.put(f"validation/{name}", values, unit=unit, dims=("sample",))
        artifact.put("validation/starts", validation.starts, unit="1", dims=("test",))
        artifact.put_json("validation/names", list(validation.names))
    atomic_write_text(context.run_directory / "close-loop.json", json.dumps(summary, indent=1) + "\n")


def _report(context: StageContext, traced: Tracing, summary: Mapping[str, Any]) -> None:
    import numpy as np
    import pandas as pd

    from mrpipe.reporting.discrepancy import (
        candidate_ranking,
        errors_per_test,
        in_plain_words,
        loops_before_and_after,
        residual_maps,
    )

    context.report.text(in_plain_words(summary))
    base = traced.selection.base
    used = base.problem.root_weight > 0.0
    residual = base.residual[used] / base.problem.root_weight[used]
    states = {name: values[used] for name, values in traced.states.values.items()}
    largest_past = states["past of drive"] + np.abs(states["drive"])
    maps = [
        ("displacement [m]", "velocity [m/s]", states["displacement"], states["velocity"]),
        ("velocity [m/s]", "drive", states["velocity"], states["drive"]),
        ("drive", "largest drive so far", states["drive"], largest_past),
        ("time in test [s]", "dissipated work [J]", states["time in test"], states["work"]),
    ]
    context.report.figure("maps", residual_maps(maps, residual), "Mean residual of the baseline over pairs of states.")
    candidates = summary["candidates"]
    if candidates:
        table = pd.DataFrame([{k: v for k, v in item.items() if k not in ("forms", "at_bound")} for item in candidates])
        context.report.table("candidates", table, "Candidates with their evidence; NRMSE on validation tests.")
        context.report.figure(
            "ranking",
            candidate_ranking(candidates),
            "Share of the recoverable residual by family; 0.9 proves a name, 0.5 is the least.",
        )
    validation = traced.validation
    order = sorted(range(validation.tests), key=lambda k: -_gain(summary["tests"][k]))[:3]
    shown = []
    for k in order:
        piece = slice(int(validation.starts[k]), int(validation.starts[k + 1]))
        shown.append(
            (
                validation.names[k],
                validation.time[piece],
                validation.displacement[piece],
                traced.measured[piece],
                traced.before[piece],
                traced.after[piece],
            )
        )
    context.report.figure("loops", loops_before_and_after(shown), "Loops and histories before and after.")
    context.report.figure(
        "errors", errors_per_test(summary["tests"], summary["noise_floor_nrmse"]), "Error of each validation test."
    )
    context.report.table("tests", pd.DataFrame(summary["tests"]), "Error of each validation test, before and after.")
    context.report.text(f"Closed loop: {summary['closed_loop']['status']}.")


def _gain(row: Mapping[str, Any]) -> float:
    return float(row["nrmse_before"] - row["nrmse_after"])


STAGE = Stage(
    name="close-loop",
    summary="Trace the residual of a model to a missing effect, add it, and judge it before and after.",
    run=_run,
    inputs=("prepare", "campaign:bench"),
    optional_inputs=("identify-frame", "calibrate", "train-inverse", "campaign:closed-loop"),
    settings=("close_loop",),
    outputs=("close-loop.h5", "close-loop.json"),
)
