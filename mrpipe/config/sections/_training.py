"""Settings that the two networks share."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, PositiveInt

from mrpipe.config.section import Section


class TrainingSettings(Section):
    """How a network is trained."""

    architecture: Literal["thesis", "sweep"] | tuple[PositiveInt, ...] = Field(
        "thesis",
        description="Hidden layers: `thesis` (two of six neurons), `sweep` (what the sweep chose, its past values and "
        "input states and biases included) or the neurons of each layer, such as [12, 6].",
    )
    biases: bool = Field(
        False, description="Biases are trained; the thesis has none (2.7), which costs about a quarter in error."
    )
    starts: int = Field(10, ge=1, description="Random starts; the best on held-out records is kept.")
    refined_starts: int = Field(2, ge=1, description="How many of the starts go on with all rows.")
    method: Literal["mu-identity", "mu-diagonal", "least-squares"] = Field(
        "mu-identity",
        description="Levenberg-Marquardt with damping mu I (trainlm), mu diag(J'J), or scipy's least_squares.",
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
        description="Penalty on the squared weights beside the mean squared normalised error; 1e-6 to 1e-4 smooths a "
        "network between the few drive levels of a campaign, the thesis has none.",
    )
    held_out_failures: int = Field(
        6, ge=1, description="Consecutive iterations without gain on the held-out records that end training (trainlm)."
    )
    gradient_tolerance: float = Field(1e-7, ge=0.0, description="Gradient that ends training (trainlm: min_grad).")
    improvement_tolerance: float = Field(
        0.0, ge=0.0, description="Relative gain over ten iterations that ends training (trainlm has none: 0)."
    )
    mu: float = Field(1e-3, gt=0.0, description="First damping (trainlm: mu).")
    mu_increase: float = Field(10.0, gt=1.0, description="Factor of the damping after a failed step (trainlm: mu_inc).")
    mu_decrease: float = Field(0.1, gt=0.0, lt=1.0, description="The same after a good step (trainlm: mu_dec).")
    mu_maximum: float = Field(1e10, gt=0.0, description="Damping that ends training (trainlm: mu_max).")
