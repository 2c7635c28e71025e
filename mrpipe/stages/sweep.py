"""`sweep`: inputs, past values, layers and neurons of the forward network, by comparison."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.networks.findings import Finding
    from mrpipe.networks.sweep import Outcome, SweepRun

CACHE = "sweep-cache"


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.networks.assembly import read_history
    from mrpipe.networks.findings import choose, findings, score
    from mrpipe.networks.plan import sweep_grid
    from mrpipe.networks.sweep import sweep
    from mrpipe.reporting import sweep as section

    settings = context.settings.sweep
    training = context.artifact("assemble")
    history = read_history(training, "training")
    grid = sweep_grid(settings, int(training.json("forward/features")["past_values"]))
    candidates = grid.candidates(settings.design)
    run = sweep(
        history,
        candidates,
        settings,
        context.seed,
        normalisation=training.attributes("/")["normalisation"],
        jobs=context.jobs,
        cache=context.run_directory / CACHE,
        crossings=(grid.crossings, grid.most_crossings) if settings.design == "star" else None,
        progress=context.progress,
        tell=context.log.info,
    )
    chosen = choose(run.outcomes)
    verdicts = findings(run.outcomes, grid.centre)
    _write(context, run, chosen, verdicts)
    section.describe(context.report, section.SweepResult(run, chosen, verdicts, grid.centre))
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
        artifact.put_json("held_out", [list(names) for names in run.held_out])
        sizes = [outcome.candidate.parameters for outcome in run.outcomes]
        artifact.put("parameters", sizes, unit="1", dims=("candidate",))
        for level in ("screened", "refined"):
            errors = np.array([getattr(outcome, level) for outcome in run.outcomes])
            artifact.put(
                f"{level}_nrmse", errors, unit="1", dims=("candidate", "start"), description="on held-out records"
            )


STAGE = Stage(
    name="sweep",
    summary="Compare network architectures: input states, past values, layers, neurons.",
    run=_run,
    inputs=("assemble",),
    settings=("sweep",),
    outputs=("sweep.h5",),
)
