"""Settings of `sweep`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, NonNegativeInt, PositiveInt

from mrpipe.config.section import Section

State = Literal["displacement", "velocity", "acceleration"]


class SweepSettings(Section):
    """Which architectures of the forward network are compared, and how long each is trained."""

    design: Literal["star", "full"] = Field(
        "star",
        description="`star` varies one thing at a time about the thesis' network and then combines what helped; "
        "`full` takes every combination.",
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
        (False, True), min_length=1, description="Without or with biases; the first is the thesis'."
    )
    starts: int = Field(5, ge=1, description="Random starts of each candidate; their spread decides what is better.")
    screen_rows: int = Field(2000, ge=50, description="Rows of the screening fit.")
    screen_iterations: int = Field(60, ge=0, description="Iterations of the screening fit at most.")
    refined: int = Field(12, ge=1, description="How many candidates, the best of the screening, are trained on.")
    refine_rows: int = Field(6000, ge=50, description="Rows of the second fit.")
    refine_iterations: int = Field(80, ge=0, description="Iterations of the second fit at most.")
    held_out_rows: int = Field(5000, ge=50, description="Rows of held-out records on which candidates are judged.")
    held_out_share: float = Field(0.25, gt=0.0, lt=0.9, description="Share of the training records held out.")
    held_out_failures: int = Field(
        10, ge=1, description="Consecutive iterations without gain on the held-out records that end a fit."
    )
    method: Literal["mu-identity", "mu-diagonal", "least-squares"] = Field(
        "mu-identity", description="Levenberg-Marquardt as for training."
    )
    initial: Literal["random", "perceptron"] = Field(
        "random",
        description="Starts: uniform within +-0.5, or a short fit by scikit-learn's MLPRegressor (with "
        "screen_iterations 0 that fit alone is the screening).",
    )
    whitened: bool = Field(True, description="Train in the basis in which the inputs are uncorrelated.")
