"""Section of the report: the inverse network."""

from __future__ import annotations

from dataclasses import dataclass

from mrpipe.networks.assembly import History
from mrpipe.networks.evaluation import Judgement
from mrpipe.networks.tracking import TrackingJudgement
from mrpipe.networks.training import Trained
from mrpipe.reporting import networks as figures
from mrpipe.reporting import training
from mrpipe.reporting.sink import Sink
from mrpipe.reporting.words import percent
from mrpipe.words import in_percent


@dataclass(frozen=True)
class TrainedInverse:
    """Results of `train-inverse` for the report.

    Attributes
    ----------
    trained, judged
        The training, and the network's errors on the validation tests.
    validation
        Validation tests.
    drive_range
        Largest minus smallest drive of the training tests [A or V].
    signed
        The same network on signed values after a short training; None where it was not compared.
    tracking
        Round trip through the forward network; None where there is no forward network.
    """

    trained: Trained
    judged: Judgement
    validation: History
    drive_range: float
    signed: Judgement | None
    tracking: TrackingJudgement | None


def describe(sink: Sink, result: TrainedInverse) -> None:
    """Write the section of `train-inverse` of the report."""
    unit = result.validation.drive_unit
    training.describe(sink, result.trained, result.judged, unit, result.drive_range)
    sink.figure(
        "drive",
        figures.drive_histories(result.validation, result.judged.samples, result.judged.estimated),
        "Drive measured and estimated on validation tests.",
    )
    if result.signed is not None:
        sink.text(
            f"A network of signed values (short training) estimates a negative drive in "
            f"{in_percent(result.signed.negative_share, 1)} of the samples; its RMS error is "
            f"{percent(result.signed.pooled.rms / result.drive_range)} of the drive range."
        )
    if result.tracking is None:
        sink.text("There is no forward network, so round trip and emulation of viscous damping are left out.")
        return
    tracking, viscous = result.tracking, result.tracking.viscous
    sink.text(
        f"Round trip from force to drive and back to force: NRMSE {tracking.pooled.nrmse:.4f}, in the post-yield "
        f"regime {tracking.regimes['post_yield'].nrmse:.4f}. Viscous damping of {viscous.damping_n_s_m:.0f} N s/m at "
        f"{viscous.frequency_hz:g} Hz is emulated with NRMSE {viscous.figures.nrmse:.3f}, and {viscous.fast.nrmse:.3f} "
        "at more than half the peak velocity."
    )
    sink.figure(
        "viscous",
        figures.viscous_emulation(viscous, unit),
        "Viscous damping emulated by inverse and forward network.",
    )
