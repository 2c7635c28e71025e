"""Options of the architecture sweep and of training; the sections `sweep`, `train_forward` and `train_inverse`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, NonNegativeInt, PositiveInt

from mrpipe.errors import UserError
from mrpipe.networks.stopping import StoppingRules
from mrpipe.options import Section

State = Literal["displacement", "velocity", "acceleration"]

THESIS_HIDDEN = (6, 6)
"""Neurons of the hidden layers of the thesis' networks, about which the sweep's star is laid."""

_TRAINLM = StoppingRules()


class SweepOptions(Section):
    """Which architectures of the forward network are compared, and how long each is trained."""

    design: Literal["star", "full"] = Field(
        "star",
        description="`star` varies one property at a time of a reference network (velocity, two layers of six "
        "neurons) and then combines the changes that helped; `full` tries every combination.",
    )
    states: tuple[tuple[State, ...], ...] = Field(
        (
            ("velocity",),
            ("displacement",),
            ("acceleration",),
            ("displacement", "velocity"),
            ("velocity", "acceleration"),
            ("displacement", "acceleration"),
            ("displacement", "velocity", "acceleration"),
        ),
        min_length=1,
        description="Motion channels tried as inputs; the drive is always one.",
    )
    past_values: tuple[NonNegativeInt, ...] = Field(
        (0, 1, 2, 3, 4, 5), min_length=1, description="Past values of each input tried."
    )
    layers: tuple[NonNegativeInt, ...] = Field(
        (1, 2, 3), min_length=1, description="Numbers of hidden layers tried (0: a linear model)."
    )
    neurons: tuple[PositiveInt, ...] = Field(
        (3, 6, 9, 12), min_length=1, description="Neurons of each hidden layer tried."
    )
    biases: tuple[bool, ...] = Field(
        (False, True), min_length=1, description="Without or with biases; the first is that of the reference network."
    )
    starts: int = Field(
        5, ge=1, description="Random starts of each candidate; their spread decides which of two is better."
    )
    screen_rows: int = Field(2000, ge=50, description="Rows of the screening fit.")
    screen_iterations: int = Field(60, ge=0, description="Iterations of the screening fit at most.")
    refined: int = Field(12, ge=1, description="How many candidates, the best of the screening, are trained further.")
    refine_rows: int = Field(6000, ge=50, description="Rows of the second fit.")
    refine_iterations: int = Field(80, ge=0, description="Iterations of the second fit at most.")
    held_out_rows: int = Field(5000, ge=50, description="Rows of held-out records on which candidates are judged.")
    held_out_share: float = Field(
        0.25,
        gt=0.0,
        lt=0.9,
        description="Share of the training tests left out of the fit of each start. 0.25 gives four splits, which the "
        "starts share; every second split leaves out all tests with the same motion together.",
    )
    held_out_failures: int = Field(
        10, ge=1, description="Consecutive iterations without gain on the held-out records that end a fit."
    )
    method: Literal["mu-identity", "mu-diagonal", "least-squares", "minpack"] = Field(
        "mu-identity", description="Levenberg-Marquardt as for training."
    )
    initial: Literal["random", "perceptron"] = Field(
        "random",
        description="Starts: uniform within +-0.5, or a short fit by scikit-learn's MLPRegressor (with "
        "screen_iterations 0 that fit alone is the screening).",
    )
    whitened: bool = Field(True, description="Train in the basis in which the inputs are uncorrelated.")

    @property
    def rules(self) -> StoppingRules:
        """The stopping rules of one fit; its number of iterations is limited by the caller."""
        return StoppingRules(held_out_failures=self.held_out_failures)


class TrainingOptions(Section):
    """How a network is trained."""

    architecture: Literal["thesis", "sweep"] | tuple[PositiveInt, ...] = Field(
        "sweep",
        description="Hidden layers: `sweep` (what the sweep chose, with its inputs, past values and biases), the "
        "neurons of each layer, such as [12, 6], or `thesis` (two layers of six).",
    )
    biases: bool = Field(
        False,
        description="Train biases. The thesis has none (2.7), which costs about a quarter in error. With "
        "architecture `sweep` the sweep decides.",
    )
    starts: int = Field(10, ge=1, description="Random starts; the best on held-out records is kept.")
    refined_starts: int = Field(2, ge=1, description="How many of the starts go on with all rows.")
    method: Literal["mu-identity", "mu-diagonal", "least-squares", "minpack"] = Field(
        "mu-identity",
        description="Levenberg-Marquardt with damping mu I (trainlm), mu diag(J'J), scipy's least_squares with a trust "
        "region, or `minpack`: scipy's least_squares with method `lm`.",
    )
    whitened: bool = Field(
        True, description="Train in the basis in which the inputs are uncorrelated; the network is the same form."
    )
    initial: Literal["random", "perceptron"] = Field(
        "random", description="Starts: uniform within +-0.5, or after a short fit by scikit-learn's MLPRegressor."
    )
    subsample_rows: int = Field(20000, ge=100, description="Rows of the first phase.")
    subsample_iterations: int = Field(150, ge=0, description="Iterations of the first phase at most.")
    iterations: int = Field(60, ge=0, description="Iterations with all rows at most (0: only the first phase).")
    refined_rows: PositiveInt | None = Field(None, description="Rows of the second phase at most; null: all of them.")
    refine_on: Literal["fitted", "every"] = Field(
        "fitted",
        description="`fitted`: the held-out records stop the second phase too. `every`: it learns them as well, for "
        "`iterations` steps; once they have chosen between the starts, a record left out is a condition not learned.",
    )
    averaged: int = Field(
        1,
        ge=1,
        description="How many of the refined starts, the best, are averaged into one network that holds them side by "
        "side; what single trainings got wrong by chance cancels in part.",
    )
    held_out_share: float = Field(
        0.15, ge=0.0, lt=0.9, description="Share of the training records held out for early stopping and choice."
    )
    weight_decay: float = Field(
        0.0,
        ge=0.0,
        description="Penalty on the squared weights, added to the mean squared normalised error; 1e-6 to 1e-4 smooths "
        "a network between the few drive levels of a campaign; the thesis has none.",
    )
    held_out_failures: int = Field(
        _TRAINLM.held_out_failures,
        ge=1,
        description="Consecutive iterations without gain on the held-out records that end training (trainlm).",
    )
    gradient_tolerance: float = Field(
        _TRAINLM.gradient, ge=0.0, description="Gradient that ends training (trainlm: min_grad)."
    )
    improvement_tolerance: float = Field(
        _TRAINLM.improvement,
        ge=0.0,
        description="Relative gain over ten iterations that ends training (trainlm has none: 0).",
    )
    mu: float = Field(_TRAINLM.mu, gt=0.0, description="First damping (trainlm: mu).")
    mu_increase: float = Field(
        _TRAINLM.mu_increase, gt=1.0, description="Factor of the damping after a failed step (trainlm: mu_inc)."
    )
    mu_decrease: float = Field(
        _TRAINLM.mu_decrease, gt=0.0, lt=1.0, description="The same after a good step (trainlm: mu_dec)."
    )
    mu_maximum: float = Field(_TRAINLM.mu_maximum, gt=0.0, description="Damping that ends training (trainlm: mu_max).")

    @property
    def rules(self) -> StoppingRules:
        """The stopping rules of one fit; its number of iterations is limited by the caller."""
        return StoppingRules(
            held_out_failures=self.held_out_failures,
            gradient=self.gradient_tolerance,
            improvement=self.improvement_tolerance,
            mu=self.mu,
            mu_increase=self.mu_increase,
            mu_decrease=self.mu_decrease,
            mu_maximum=self.mu_maximum,
        )

    @property
    def hidden(self) -> tuple[int, ...]:
        """Neurons of each hidden layer.

        Raises
        ------
        UserError
            If the architecture is that of a sweep (:func:`mrpipe.networks.plan.training_plan` inserts the chosen one).
        """
        if self.architecture == "sweep":
            raise UserError("architecture", "sweep", "needs the result of a sweep", "give the hidden layers, as (6, 6)")
        return THESIS_HIDDEN if self.architecture == "thesis" else self.architecture


class ViscousEmulationOptions(Section):
    """Pure viscous damping emulated by the inverse and the forward network (thesis 2.4.3)."""

    amplitude_m: float | None = Field(
        None,
        gt=0.0,
        description="Amplitude of the sinusoidal motion; the 95th percentile of the campaign's by default.",
    )
    frequency_hz: float = Field(1.0, gt=0.0, description="Its frequency.")
    damping_n_s_m: float | None = Field(
        None,
        gt=0.0,
        description="Viscous coefficient; by default the one whose peak force is half the largest of the campaign.",
    )


class InverseTrainingOptions(TrainingOptions):
    """How the inverse network (force to drive) is trained."""

    architecture: Literal["thesis", "sweep"] | tuple[PositiveInt, ...] = Field(
        (12, 6),
        description="Hidden layers: the neurons of each, `sweep` (what the sweep chose for the forward network, "
        "with its past values and biases), or `thesis` (two layers of six).",
    )
    biases: bool = Field(
        True,
        description="Biases are trained. The thesis has none; but on absolute values the drive is not an odd function, "
        "and without them it is bound to zero at zero force, where the damper holds its residual force.",
    )
    starts: int = Field(6, ge=1, description="Random starts; the best on held-out records go on.")
    refined_starts: int = Field(4, ge=1, description="How many of the starts go on.")
    averaged: int = Field(
        4,
        ge=1,
        description="How many of the refined starts, the best, are averaged into one network that holds them side by "
        "side; what single trainings got wrong by chance cancels in part.",
    )
    subsample_rows: int = Field(8000, ge=100, description="Rows of the first phase.")
    subsample_iterations: int = Field(120, ge=0, description="Iterations of the first phase at most.")
    refined_rows: PositiveInt | None = Field(40000, description="Rows of the second phase at most; null: all of them.")
    refine_on: Literal["fitted", "every"] = Field(
        "every",
        description="`every`: the second phase learns the held-out records too, for `iterations` steps; once they have "
        "chosen between the starts, a record left out is a condition not learned. `fitted`: they stop it.",
    )
    iterations: int = Field(160, ge=0, description="Iterations of the second phase at most (0: only the first phase).")
    held_out_failures: int = Field(
        30,
        ge=1,
        description="Consecutive iterations without gain on the held-out records that end the first phase; trainlm's "
        "6 end it on a plateau that it would leave.",
    )

    compare_signed: bool = Field(
        True, description="Train a short second network on signed values, to compare the share of negative drive."
    )
    viscous: ViscousEmulationOptions = Field(ViscousEmulationOptions(), description="The emulation of viscous damping.")
