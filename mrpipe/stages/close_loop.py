"""`close-loop`: the residual of the declared model, traced to a missing effect, added, error before and after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.discrepancy.summary import Tracing


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.discrepancy.summary import TracingOptions
    from mrpipe.discrepancy.tracing import trace_campaign
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
    """Replay the closed-loop recordings with the damper before and after; the inverse follows the damper."""
    needed = ["campaign:closed-loop", "identify-frame", "calibrate"]
    if context.settings.simulate.controller.inverse == "network":
        needed.append("train-inverse")
    lacking = [name.removeprefix("campaign:") for name in needed if name not in context.inputs]
    if lacking:
        return {"status": f"skipped: no {' and no '.join(lacking)}"}
    from mrpipe.campaigns import load_campaign
    from mrpipe.control.controller import Controller, Gains
    from mrpipe.discrepancy.closed_loop import MeasuredRun, compare_laws, damper_of, measured_runs, plant_chain
    from mrpipe.simulation.loop import LoopOptions
    from mrpipe.stages.simulate import controller
    from mrpipe.structures import read_frame

    runs = measured_runs(load_campaign(context.inputs["campaign:closed-loop"]))
    if not runs:
        return {"status": "skipped: no closed-loop recording names its law and floor displacements"}
    frame = read_frame(context.artifact("identify-frame"))
    damper = damper_of(traced.selection.base, traced.drive_unit)

    def make(run: MeasuredRun) -> Controller:
        # the rig ran with the controller as calibrated: what the effect changes is the plant
        gains = Gains(**run.gains) if run.gains else None
        return controller(context, run.law, frame, damper, gains)

    chains = {"before": plant_chain(traced.selection.base), "after": plant_chain(traced.selection.chosen)}
    position = context.artifact("calibrate").array("position")
    context.progress(0.95, "closed loop before and after")
    return compare_laws(runs, frame, chains, {"before": make, "after": make}, position, LoopOptions())


def _write(context: StageContext, traced: Tracing, summary: Mapping[str, Any]) -> None:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.artifacts.plain import to_json

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
    atomic_write_text(context.run_directory / "close-loop.json", to_json(summary) + "\n")


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
    for name, reason in summary["untestable"].items():
        context.report.text(f"Effect {name}: {reason}.")
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
    _report_closed_loop(context, summary["closed_loop"])


def _report_closed_loop(context: StageContext, found: Mapping[str, Any]) -> None:
    import pandas as pd

    if "tests" not in found:
        context.report.text(f"Closed loop: {found['status']}.")
        return
    rows = []
    for item in found["tests"]:
        row = {"test": item["test"], "law": item["law"]}
        for when in ("measured", "before", "after"):
            row |= {
                f"{name}_{when}": value for name, value in item[when].items() if name.startswith(("rms_x", "nrmse"))
            }
        rows.append(row)
    context.report.table("closed-loop", pd.DataFrame(rows), "Closed loop: measured, and predicted before and after.")
    errors, changes = found["nrmse_x_top"], "changes" if found["ranking_changes"] else "does not change"
    context.report.text(
        f"Closed loop, {found['status']} with the measured ground motion: error of the top floor's displacement "
        f"{errors['before']:.3f} before and {errors['after']:.3f} after (RMS over RMS). The ranking of the laws "
        f"{changes}: measured {', '.join(found['ranking']['measured'])}; "
        f"predicted {', '.join(found['ranking']['after'])}."
    )


def _gain(row: Mapping[str, Any]) -> float:
    return float(row["nrmse_before"] - row["nrmse_after"])


STAGE = Stage(
    name="close-loop",
    summary="Trace the residual of a model to a missing effect, add it, and judge it before and after.",
    run=_run,
    inputs=("prepare", "campaign:bench"),
    optional_inputs=("identify-frame", "calibrate", "train-inverse", "campaign:closed-loop"),
    settings=("close_loop", "simulate.controller"),
    outputs=("close-loop.h5", "close-loop.json"),
)
