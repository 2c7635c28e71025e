"""Section of the report: the architecture sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp

import pandas as pd

from mrpipe.networks.candidates import Candidate
from mrpipe.networks.findings import WORTHWHILE, Finding, score
from mrpipe.networks.sweep import Outcome, SweepRun
from mrpipe.reporting import networks as figures
from mrpipe.reporting.sink import Sink
from mrpipe.words import in_percent


@dataclass(frozen=True)
class SweepResult:
    """Results of `sweep` for the report.

    Attributes
    ----------
    run
        Every candidate with its errors.
    chosen
        The smallest network that is not clearly worse than the best.
    verdicts
        Statements of the thesis on architectures, checked.
    centre
        Reference network that one axis at a time is varied about.
    """

    run: SweepRun
    chosen: Outcome
    verdicts: Sequence[Finding]
    centre: Candidate


def describe(sink: Sink, result: SweepResult) -> None:
    """Write the section of `sweep` of the report."""
    outcomes, chosen = result.run.outcomes, result.chosen
    sink.text(
        f"{len(outcomes)} architectures, each from {len(chosen.screened)} random starts, were screened on few rows; "
        f"{sum(outcome.is_refined for outcome in outcomes)} were trained further. Each start is judged on training "
        f"tests that were left out of its fit, in {len(result.run.held_out)} splits. Every second "
        "split leaves out all tests of one motion together, so that unseen motions count too. Chosen is the smallest "
        "network that is worse than the best by less than the standard error of their ratio and by less than "
        f"{in_percent(WORTHWHILE)}: {chosen.candidate.label}."
    )
    sink.table(
        "findings",
        _verdicts(result.verdicts),
        "General statements on architectures, checked on this campaign; change of the error with its 95 % interval.",
    )
    sink.table("candidates", _candidates(outcomes), "All candidates; errors over the starts on held-out records.")
    sink.figure(
        "axes",
        figures.sweep_axes(outcomes, result.centre),
        "Error along each axis of the sweep through the reference network (points: single starts).",
    )
    sink.figure(
        "sizes", figures.sweep_sizes(outcomes, chosen), "Error against number of parameters; the choice is ringed."
    )


def _candidates(outcomes: Sequence[Outcome]) -> pd.DataFrame:
    rows = []
    for outcome in sorted(outcomes, key=lambda item: (not item.is_refined, item.candidate.parameters)):
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
    return pd.DataFrame(rows)


def _verdicts(verdicts: Sequence[Finding]) -> pd.DataFrame:
    return pd.DataFrame(
        [
            {
                "statement": item.statement,
                "compared": item.alternative,
                "with": item.reference,
                "NRMSE": item.alternative_nrmse,
                "NRMSE of the reference": item.reference_nrmse,
                "change [%]": 100.0 * item.change,
                # the standard error is that of the logarithm of the ratio
                "from [%]": 100.0 * ((1.0 + item.change) * exp(-item.uncertainty) - 1.0),
                "to [%]": 100.0 * ((1.0 + item.change) * exp(item.uncertainty) - 1.0),
                "fit": item.level,
                "verdict": item.verdict,
            }
            for item in verdicts
        ]
    )
