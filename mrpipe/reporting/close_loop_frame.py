"""Section of the report: the residual of a structure traced to a missing effect."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from mrpipe.reporting import structure_tracing as figures
from mrpipe.reporting.bench_tracing import candidate_ranking, errors_per_test
from mrpipe.reporting.sink import Sink
from mrpipe.tracing.structure.verdict import StructureTracing


@dataclass(frozen=True)
class TracedStructure:
    """Results of `close-loop` on a structure, for the report.

    Attributes
    ----------
    tracing
        The tracing with its models and errors.
    named_share, least_share
        Share of the residual above which an effect is named, and above which it is considered.
    """

    tracing: StructureTracing
    named_share: float
    least_share: float


def describe(sink: Sink, result: TracedStructure) -> None:
    """Write the section of `close-loop` of the report."""
    traced, summary = result.tracing, result.tracing.summary
    sink.text(figures.in_plain_words(summary))
    if traced.maps:
        sink.figure("maps", figures.storey_maps(traced.maps), figures.MAPS_CAPTION)
    if summary["candidates"]:
        rows = [{k: v for k, v in item.items() if k not in ("forms", "at_bound")} for item in summary["candidates"]]
        sink.table("candidates", pd.DataFrame(rows), "Candidates with their evidence.")
        sink.figure(
            "ranking",
            candidate_ranking(summary["candidates"], result.named_share, result.least_share),
            "Share of the residual above the noise that each family of effects explains.",
        )
    if traced.shown:
        sink.figure(
            "histories", figures.histories(traced.shown), "Residual of validation tests before and after, per storey."
        )
    if summary["tests"]:
        sink.figure(
            "errors", errors_per_test(summary["tests"], summary["noise_floor_nrmse"]), "Error of each validation test."
        )
        sink.table("tests", pd.DataFrame(summary["tests"]), "Error of each validation test.")
