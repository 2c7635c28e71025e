"""Section of the report: the training set of the networks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from mrpipe.networks.assembly import History
from mrpipe.reporting.networks import joined_history
from mrpipe.reporting.sink import Sink


@dataclass(frozen=True)
class TrainingSet:
    """What `assemble` joined.

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
    """Write the section."""
    training = result.training
    sink.text(
        f"{len(training.names)} training tests, joined at zero crossings of the displacement, give {training.samples} "
        f"samples at {training.sampling_rate_hz:g} Hz. {len(result.validation.names)} validation tests are assembled "
        "in the same way and kept apart. No window of past values reaches across a join."
    )
    sink.table(
        "joins",
        pd.DataFrame(
            {
                "channel": list(result.jumps),
                "step at joins over largest step within": list(result.jumps.values()),
            }
        ),
        "Continuity at the joins. The displacement is continuous; velocity and force of tests at different frequency "
        "or drive are not, and no network sees these steps.",
    )
    sink.figure("history", joined_history(training), "The joined training history.")
