"""Section of the report: the training set of the networks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from mrpipe.networks.assembly import CONTINUOUS, History
from mrpipe.reporting.networks import joined_history
from mrpipe.reporting.sink import Sink


@dataclass(frozen=True)
class TrainingSet:
    """Rows that `assemble` joined, for the report.

    Attributes
    ----------
    training, validation
        Joined histories.
    jumps
        Channel -> largest step at a join over the largest step within a test.
    """

    training: History
    validation: History
    jumps: Mapping[str, float]


def describe(sink: Sink, result: TrainingSet) -> None:
    """Write the section of `assemble` of the report."""
    training = result.training
    sink.text(
        f"{len(training.names)} training tests, one after the other, give {training.samples} samples at "
        f"{training.sampling_rate_hz:g} Hz. Periodic tests are cut at upward zero crossings of the displacement; tests "
        f"with another motion are used completely. {len(result.validation.names)} validation tests are assembled in "
        "the same way and kept apart. No window of past values reaches across a join."
    )
    sink.table(
        "joins",
        pd.DataFrame(
            {
                "channel": list(result.jumps),
                "step at joins over largest step within": list(result.jumps.values()),
            }
        ),
        f"Continuity at the joins. {_continuity(result.jumps)} Velocity and force of tests at different frequency or "
        "drive have steps. No network sees a step, because no window reaches across a join.",
    )
    sink.figure("history", joined_history(training), "The joined training history.")


def _continuity(jumps: Mapping[str, float]) -> str:
    """Return whether the displacement is continuous at the joins."""
    if jumps.get("displacement", 0.0) <= CONTINUOUS:
        return "The displacement is continuous."
    return (
        "The displacement is continuous between periodic tests; it has steps where a test with another motion begins "
        "or ends, because such a test is used completely."
    )
