"""Section of the report: the parametric damper model and its rivals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from mrpipe.fitting.comparison import JudgedFit
from mrpipe.fitting.scoring import shown_loops, yield_curves
from mrpipe.reporting.dampers import comparison_bars, damper_loops, yield_force_curves
from mrpipe.reporting.sink import Sink
from mrpipe.signals.prepared import PreparedTest


@dataclass(frozen=True)
class IdentifiedDamper:
    """Results of `identify-damper` for the report.

    Attributes
    ----------
    tests
        The prepared tests.
    judged
        Every form that was fitted, with its errors.
    chosen
        The one that later stages use.
    summary
        The summary that the stage prints.
    """

    tests: Sequence[PreparedTest]
    judged: Sequence[JudgedFit]
    chosen: JudgedFit
    summary: Mapping[str, Any]


def describe(sink: Sink, result: IdentifiedDamper) -> None:
    """Write the section of `identify-damper` of the report."""
    tests, judged, chosen, summary = result.tests, result.judged, result.chosen, result.summary
    sink.text(
        f"Damper model {chosen.fit.form.name} ({chosen.fit.form.summary}; {chosen.fit.form.source}): NRMSE "
        f"{chosen.training.nrmse:.3f} on the training tests, {chosen.validation.nrmse:.3f} on the validation tests. "
        f"{summary['reason']} Of the forms compared {summary['comparison'][0]['form']} has the smallest error on the "
        "validation tests."
    )
    if summary["drive_law"]:
        sink.text(f"Law of the drive: {summary['drive_law']['reason']}.")
    tables = {
        "parameters": (pd.DataFrame(summary["parameters"]).T.rename_axis("name").reset_index(), "Parameters (SI)."),
        "classical-parameters": (
            pd.DataFrame(summary["thesis_parameters"]).T.rename_axis("name").reset_index(),
            "The same in the classical notation of the Bouc-Wen model (alpha, beta, gamma, A), for a chosen A.",
        ),
        "comparison": (
            pd.DataFrame(summary["comparison"]),
            "Model forms by their error on the validation tests, which no fit has seen.",
        ),
        "ranking": (
            pd.DataFrame(summary["ranking"]),
            "All forms by their error on a share of the training samples; those near the best were fitted to all.",
        ),
        "drive-law": (
            pd.DataFrame((summary["drive_law"] or {}).get("predictions", [])),
            "Yield force and viscosity at the levels of drive, between and beyond them, with standard deviations.",
        ),
        "tests": (pd.DataFrame(summary["tests"]), "Error of each test."),
    }
    for name, (frame, caption) in tables.items():
        if len(frame):
            sink.table(name, frame, caption)
    unit = chosen.fit.model.drive_unit
    sink.figure(
        "loops",
        damper_loops(shown_loops(chosen.fit.model, tests)),
        "Measured loops and those of the model.",
    )
    sink.figure(
        "comparison",
        comparison_bars(
            [(row["form"], row["training_nrmse"], row["validation_nrmse"]) for row in summary["comparison"]]
        ),
        "Error of the model forms.",
    )
    drive, curves = yield_curves([(item.fit.form.name, item.fit.model) for item in judged], tests)
    sink.figure("yield-force", yield_force_curves(drive, curves, unit), "Post-yield force at half the largest speed.")
