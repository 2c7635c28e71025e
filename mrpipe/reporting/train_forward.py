"""Section of the report: the forward network."""

from __future__ import annotations

from dataclasses import dataclass

from mrpipe.networks.assembly import History
from mrpipe.networks.evaluation import ErrorFigures, Judgement
from mrpipe.networks.training import Trained
from mrpipe.reporting import networks as figures
from mrpipe.reporting import training
from mrpipe.reporting.sink import Sink


@dataclass(frozen=True)
class TrainedForward:
    """Results of `train-forward` for the report.

    Attributes
    ----------
    trained, judged
        The training, and the network's errors on the validation tests.
    validation
        Validation tests.
    free
        Errors where the network runs on its own past outputs; None where these are not inputs.
    """

    trained: Trained
    judged: Judgement
    validation: History
    free: ErrorFigures | None


def describe(sink: Sink, result: TrainedForward) -> None:
    """Write the section of `train-forward` of the report."""
    if result.free is not None:
        sink.text(
            f"NRMSE {result.judged.pooled.nrmse:.4f} one step ahead, {result.free.nrmse:.4f} when the network runs on "
            "its own past outputs."
        )
    training.describe(sink, result.trained, result.judged, "N")
    sink.figure(
        "loops",
        figures.force_loops(result.validation, result.judged.samples, result.judged.estimated),
        "Force against displacement and velocity on validation tests.",
    )
