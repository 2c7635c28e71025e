"""What the report says of any training: architecture, errors on unseen tests, spread over the starts."""

from __future__ import annotations

import pandas as pd

from mrpipe.networks.evaluation import Judgement
from mrpipe.networks.network import Network
from mrpipe.networks.training import Trained
from mrpipe.reporting import networks as figures
from mrpipe.reporting.sink import Sink
from mrpipe.reporting.words import percent
from mrpipe.words import counted


def describe(sink: Sink, trained: Trained, judged: Judgement, unit: str, span: float | None = None) -> None:
    """Write the part of the report that both networks share.

    Parameters
    ----------
    sink
        Part of the report that is written.
    trained, judged
        The training, and the network's errors on the validation tests.
    unit, span
        Unit and range of the target, see :meth:`mrpipe.networks.evaluation.Judgement.rows`.
    """
    network, pooled = trained.network, judged.pooled
    spread = [start.held_out_nrmse for start in trained.starts]
    size = f"{pooled.nrmse:.4f} (NRMSE)" if span is None else f"{percent(pooled.rms / span)} of the drive range"
    rival = f"{judged.linear.nrmse:.3f}" if span is None else percent(judged.linear.rms / span)
    sink.text(
        f"Network {network.architecture} with {network.parameters} parameters "
        f"({'with' if network.has_biases else 'without'} biases): {_taken(network)} of {len(trained.starts)} starts, "
        f"judged on {counted(len(trained.held_out), 'training record')} that {_were(len(trained.held_out))} held out. "
        "Error on the validation tests: "
        f"{size}; a linear model of the same inputs: {rival}."
    )
    if spread:
        sink.text(f"Held-out NRMSE of the starts before refinement: {min(spread):.4f} to {max(spread):.4f}.")
    sink.table("errors", pd.DataFrame(judged.rows(unit, span)), "Errors on the validation tests.")
    sink.table("tests", pd.DataFrame(judged.test_rows(unit, span)), "Errors of each validation test.")
    sink.table("starts", _starts(trained), "Every start.")
    sink.figure(
        "training",
        figures.training_progress(trained.path, spread),
        "Training error of the chosen start, and the held-out error of all starts.",
    )


def _starts(trained: Trained) -> pd.DataFrame:
    rows = [
        {
            "start": number,
            "training NRMSE (subsample)": start.subsample_nrmse,
            "held-out NRMSE": start.held_out_nrmse,
            "held-out NRMSE, all rows": start.refined_held_out_nrmse,
            "iterations": start.iterations,
            "ended by": start.reason,
        }
        for number, start in enumerate(trained.starts, start=1)
    ]
    # after a second phase that learned the held-out records there is no held-out error
    return pd.DataFrame(rows).dropna(axis="columns", how="all")


def _were(count: int) -> str:
    return "was" if count == 1 else "were"


def _taken(network: Network) -> str:
    if network.members == 1:
        return "the best"
    inner = "-".join(str(count) for count in network.hidden_of_members)
    return f"the mean of the best {network.members} (each {inner})"
