"""Plan of a training stage: features and options from the settings, the training set and the sweep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from mrpipe.artifacts import Artifact
from mrpipe.networks.assembly import History, read_history
from mrpipe.networks.candidates import Candidate, Grid
from mrpipe.networks.evaluation import Judgement, yield_time
from mrpipe.networks.network import FeatureSpec, spec_from_json
from mrpipe.networks.options import THESIS_HIDDEN, SweepOptions, TrainingOptions
from mrpipe.networks.scaling import Normalisation
from mrpipe.networks.training import Trained
from mrpipe.signals.error_size import doubt_about_fit


@dataclass(frozen=True)
class TrainingPlan:
    """Data and options of one training.

    Attributes
    ----------
    training, validation
        Joined histories of the training and the validation tests.
    spec
        Features and target of the network.
    options
        Options of the training, with the numbers of neurons of the hidden layers.
    normalisation
        Normalisation of inputs and target, as in the training set.
    """

    training: History
    validation: History
    spec: FeatureSpec
    options: TrainingOptions
    normalisation: Normalisation


def training_plan(
    options: TrainingOptions, training_set: Artifact, choice: Mapping[str, Any], kind: Literal["forward", "inverse"]
) -> TrainingPlan:
    """Return the plan of one training.

    Parameters
    ----------
    options
        Settings of the stage; the architecture `sweep` is replaced by the choice of the sweep.
    training_set
        Artifact of `assemble`.
    choice
        Choice of the sweep: `channels`, `past_values`, `hidden`, `biases`. It is read for the architecture `sweep`
        only.
    kind
        Kind of the network. An inverse network uses past values, layers and biases of the choice, but its input
        channels remain those of the training set.
    """
    spec = spec_from_json(training_set.json(f"{kind}/features"))
    if options.architecture == "sweep":
        options = options.changed(architecture=tuple(choice["hidden"]), biases=choice["biases"])
        spec = replace(spec, past_values=choice["past_values"])
        if kind == "forward":
            spec = replace(spec, channels=tuple(choice["channels"]))
    return TrainingPlan(
        read_history(training_set, "training"),
        read_history(training_set, "validation"),
        spec,
        options,
        training_set.attributes("/")["normalisation"],
    )


def sweep_grid(options: SweepOptions, past_values: int) -> Grid:
    """Return the axes of a sweep around the reference network, which has `past_values` past values."""
    centre = Candidate(("velocity",), past_values, THESIS_HIDDEN, options.biases[0])
    return Grid(
        states=tuple(tuple(states) for states in options.states),
        past_values=tuple(options.past_values),
        layers=tuple(options.layers),
        neurons=tuple(options.neurons),
        biases=tuple(options.biases),
        centre=centre,
    )


def fit_doubt(judged: Judgement, plan: TrainingPlan) -> str | None:
    """Return why the fit of a network on the validation tests is not defined, or says little; None otherwise."""
    if not judged.pooled.samples:
        return "the campaign has no validation test"
    return doubt_about_fit(judged.pooled.nrmse, judged.pooled.fit_percent, plan.spec.target)


def training_summary(trained: Trained, judged: Judgement, plan: TrainingPlan) -> dict[str, Any]:
    """Return what `train-forward` and `train-inverse` print: architecture, errors, baseline, spread over starts."""
    network = trained.network
    return {
        "architecture": network.architecture,
        "members": network.members,
        "training_nrmse": judged.training.nrmse,
        "validation_nrmse": judged.pooled.nrmse,
        "validation_fit_percent": judged.pooled.fit_percent,
        "validation_fit_doubt": fit_doubt(judged, plan),
        "parameters": network.parameters,
        "iterations": trained.iterations,
        "seconds": trained.seconds,
        "r2": judged.pooled.r2,
        "linear_baseline_nrmse": judged.linear.nrmse,
        "linear_baseline_r2": judged.linear.r2,
        "regime_nrmse": {name: figures.nrmse for name, figures in judged.regimes.items()},
        "yield_travel_m": judged.yield_travel_m,
        "yield_time_s": yield_time(plan.validation, judged.yield_travel_m),
        "training_tests": len(plan.training.names),
        "training_tests_with_varying_drive": sum(plan.training.drive_varies),
        "constant_drive_nrmse": judged.constant.nrmse,
        "varying_drive_nrmse": judged.varying.nrmse,
        "held_out_nrmse_of_starts": [start.held_out_nrmse for start in trained.starts],
        "starts": len(trained.starts),
        "biases": network.has_biases,
        "inputs": list(network.features.channels),
        "past_values": network.features.past_values,
        "sampling_rate_hz": network.features.sampling_rate_hz,
        "outside_training_range_share": judged.outside_training_range,
    }
