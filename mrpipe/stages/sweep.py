"""`sweep`: which inputs, past values, layers and neurons the forward network needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.stages.train_forward import THESIS_HIDDEN

if TYPE_CHECKING:
    from mrpipe.networks.candidates import Grid
    from mrpipe.networks.findings import Finding
    from mrpipe.networks.sweep import Outcome, SweepOptions, SweepRun

CACHE = "sweep-cache"


def _grid(settings: Any, past_values: int) -> Grid:
    from mrpipe.networks.candidates import Candidate, Grid

    centre = Candidate(("velocity",), past_values, THESIS_HIDDEN, settings.biases[0])
    return Grid(
        states=tuple(tuple(states) for states in settings.states),
        past_values=tuple(settings.past_values),
        layers=tuple(settings.layers),
        neurons=tuple(settings.neurons),
        biases=tuple(settings.biases),
        centre=centre,
    )


def _options(settings: Any, normalisation: Any) -> SweepOptions:
    from mrpipe.networks.levenberg_marquardt import StoppingRules
    from mrpipe.networks.sweep import SweepOptions

    return SweepOptions(
        starts=settings.starts,
        screen_rows=settings.screen_rows,
        screen_iterations=settings.screen_iterations,
        refined=settings.refined,
        refine_rows=settings.refine_rows,
        refine_iterations=settings.refine_iterations,
        held_out_rows=settings.held_out_rows,
        held_out_share=settings.held_out_share,
        method=settings.method,
        whitened=settings.whitened,
        normalisation=normalisation,
        initial=settings.initial,
        rules=StoppingRules(held_out_failures=settings.held_out_failures),
    )


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.networks.assembly import read_history
    from mrpipe.networks.findings import choose, findings, score
    from mrpipe.networks.sweep import sweep

    settings = context.settings.sweep
    training = context.artifact("assemble")
    history = read_history(training, "training")
    grid = _grid(settings, int(training.json("forward/features")["past_values"]))
    candidates = grid.candidates(settings.design)
    run = sweep(
        history,
        candidates,
        _options(settings, training.attributes("/")["normalisation"]),
        context.seed,
        jobs=context.jobs,
        cache=context.run_directory / CACHE,
        crossings=(grid.crossings, grid.most_crossings) if settings.design == "star" else None,
        progress=context.progress,
        tell=context.log.info,
    )
    chosen = choose(run.outcomes)
    verdicts = findings(run.outcomes, grid.centre)
    _write(context, run, chosen, verdicts)
    _report(context, run, chosen, verdicts, grid)
    best = score(chosen.refined)
    return {
        "candidates": len(run.outcomes),
        "starts": settings.starts,
        "refined": sum(outcome.is_refined for outcome in run.outcomes),
        "choice": chosen.candidate.label,
        "choice_nrmse": best.mean,
        "choice_best_start_nrmse": best.best,
        "choice_parameters": chosen.candidate.parameters,
        "findings": {
            item.name: {
                "statement": item.statement,
                "change": item.change,
                "uncertainty": item.uncertainty,
                "verdict": item.verdict,
            }
            for item in verdicts
        },
        "predicted_seconds": run.predicted_seconds,
        "seconds": run.seconds,
    }


def _write(context: StageContext, run: SweepRun, chosen: Outcome, verdicts: list[Finding]) -> None:
    from dataclasses import asdict

    import numpy as np

    candidate = chosen.candidate
    with context.write("sweep.h5") as artifact:
        artifact.put_json(
            "choice",
            {
                "channels": list(candidate.channels),
                "past_values": candidate.past_values,
                "hidden": list(candidate.hidden),
                "biases": candidate.biases,
            },
        )
        artifact.put_json("candidates", [outcome.candidate.label for outcome in run.outcomes])
        artifact.put_json("findings", [asdict(item) for item in verdicts])
        artifact.put_json("held_out", list(run.held_out))
        sizes = [outcome.candidate.parameters for outcome in run.outcomes]
        artifact.put("parameters", sizes, unit="1", dims=("candidate",))
        for level in ("screened", "refined"):
            errors = np.array([getattr(outcome, level) for outcome in run.outcomes])
            artifact.put(
                f"{level}_nrmse", errors, unit="1", dims=("candidate", "start"), description="on held-out records"
            )


def _report(context: StageContext, run: SweepRun, chosen: Outcome, verdicts: list[Finding], grid: Grid) -> None:
    import pandas as pd

    from mrpipe.networks.findings import score
    from mrpipe.reporting import networks as figures

    context.report.text(
        f"{len(run.outcomes)} architectures, each from {len(chosen.screened)} starts, were screened on few rows; "
        f"{sum(outcome.is_refined for outcome in run.outcomes)} were trained further. All are judged on "
        f"{len(run.held_out)} training records that no fit has seen. The choice, the smallest network within one "
        f"standard error of the best: {chosen.candidate.label}."
    )
    rows = []
    for outcome in sorted(run.outcomes, key=lambda item: (not item.is_refined, item.candidate.parameters)):
        level = score(outcome.refined if outcome.is_refined else outcome.screened)
        rows.append(
            {
                "architecture": outcome.candidate.label,
                "parameters": outcome.candidate.parameters,
                "level": "refined" if outcome.is_refined else "screened",
                "NRMSE": level.mean,
                "standard error": level.mean * level.standard_error,
                "best start": level.best,
                "worst start": level.worst,
                "screened NRMSE": score(outcome.screened).mean,
            }
        )
    verdict_rows = [
        {
            "the thesis says": item.statement,
            "compared": item.alternative,
            "with": item.reference,
            "NRMSE": item.alternative_nrmse,
            "NRMSE of the thesis' network": item.reference_nrmse,
            "change": item.change,
            "two standard errors": item.uncertainty,
            "fit": item.level,
            "verdict": item.verdict,
        }
        for item in verdicts
    ]
    context.report.table("findings", pd.DataFrame(verdict_rows), "The findings of thesis 2.3.2, checked.")
    context.report.table("candidates", pd.DataFrame(rows), "All candidates, error over starts on held-out records.")
    context.report.figure(
        "axes",
        figures.sweep_axes(run.outcomes, grid.centre),
        "Error over starts (points: single starts) along each axis of the sweep through the thesis' network.",
    )
    context.report.figure(
        "sizes", figures.sweep_sizes(run.outcomes, chosen), "Error against number of parameters; the choice is ringed."
    )


STAGE = Stage(
    name="sweep",
    summary="Compare network architectures: input states, past values, layers, neurons.",
    run=_run,
    inputs=("assemble",),
    settings=("sweep",),
    outputs=("sweep.h5",),
)
