"""Options of the architecture sweep and of training; the sections `sweep`, `train_forward` and `train_inverse`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, NonNegativeInt, PositiveInt

from mrpipe.errors import UserError
from mrpipe.networks.stopping import StoppingRules
from mrpipe.options import Section

State = Literal["displacement", "velocity", "acceleration"]

THESIS_HIDDEN = (6, 6)
"""Neurons of the hidden layers of the networks of the thesis, which are the reference of the sweep."""

_TRAINLM = StoppingRules()


class SweepOptions(Section):
    """Architectures of the forward network that are compared, and their training."""

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
        description="Motion channels that are tried as inputs; the drive is always an input.",
    )
    past_values: tuple[NonNegativeInt, ...] = Field(
        (0, 1, 2, 3, 4, 5), min_length=1, description="Numbers of past values of each input that are tried."
    )
    layers: tuple[NonNegativeInt, ...] = Field(
        (1, 2, 3), min_length=1, description="Numbers of hidden layers that are tried (0: a linear model)."
    )
    neurons: tuple[PositiveInt, ...] = Field(
        (3, 6, 9, 12), min_length=1, description="Numbers of neurons of each hidden layer that are tried."
    )
    biases: tuple[bool, ...] = Field(
        (False, True), min_length=1, description="Without or with biases; the first is that of the reference network."
    )
    starts: int = Field(
        5,
        ge=1,
        description="Number of random starts of each candidate; their spread decides whether one candidate is better "
        "than another.",
    )
    screen_rows: int = Field(2000, ge=50, description="Number of rows of the screening fit.")
    screen_iterations: int = Field(60, ge=0, description="Largest number of iterations of the screening fit.")
    refined: int = Field(
        12, ge=1, description="Number of the best candidates of the screening that are trained further."
    )
    refine_rows: int = Field(6000, ge=50, description="Number of rows of the second fit.")
    refine_iterations: int = Field(80, ge=0, description="Largest number of iterations of the second fit.")
    held_out_rows: int = Field(
        5000, ge=50, description="Number of rows of held-out records on which candidates are judged."
    )
    held_out_share: float = Field(
        0.25,
        gt=0.0,
        lt=0.9,
        description="Share of the training tests left out of the fit of each start. 0.25 gives four splits, which the "
        "starts share; every second split leaves out all tests with the same motion together.",
    )
    held_out_failures: int = Field(
        10,
        ge=1,
        description="Number of consecutive iterations without improvement on the held-out records after which a fit "
        "ends.",
    )
    method: Literal["mu-identity", "mu-diagonal", "least-squares", "minpack"] = Field(
        "mu-identity", description="Levenberg-Marquardt as for training."
    )
    initial: Literal["random", "perceptron"] = Field(
        "random",
        description="Starts: uniform within +-0.5, or a short fit by scikit-learn's MLPRegressor (with "
        "screen_iterations 0 that fit alone is the screening).",
    )
    whitened: bool = Field(True, description="Whether the training uses a basis in which the inputs are uncorrelated.")

    @property
    def rules(self) -> StoppingRules:
        """The stopping rules of one fit; its number of iterations is limited by the caller."""
        return StoppingRules(held_out_failures=self.held_out_failures)


class TrainingOptions(Section):
    """Options of the training of a network."""

    architecture: Literal["thesis", "sweep"] | tuple[PositiveInt, ...] = Field(
        "sweep",
        description="Hidden layers: `sweep` (what the sweep chose, with its inputs, past values and biases), the "
        "neurons of each layer, such as [12, 6], or `thesis` (two layers of six).",
    )
    biases: bool = Field(
        False,
        description="Whether the network has biases. The thesis has none (2.7), with an error that is about 25 % "
        "larger. With architecture `sweep` the sweep decides.",
    )
    starts: int = Field(10, ge=1, description="Number of random starts; the best one on held-out records is kept.")
    refined_starts: int = Field(
        2, ge=1, description="Number of the best starts that are trained further with all rows."
    )
    method: Literal["mu-identity", "mu-diagonal", "least-squares", "minpack"] = Field(
        "mu-identity",
        description="Levenberg-Marquardt with damping mu I (trainlm), mu diag(J'J), scipy's least_squares with a trust "
        "region, or `minpack`: scipy's least_squares with method `lm`.",
    )
    whitened: bool = Field(
        True,
        description="Whether the training uses a basis in which the inputs are uncorrelated; the form of the network "
        "is the same.",
    )
    initial: Literal["random", "perceptron"] = Field(
        "random", description="Starts: uniform within +-0.5, or after a short fit by scikit-learn's MLPRegressor."
    )
    subsample_rows: int = Field(20000, ge=100, description="Number of rows of the first phase.")
    subsample_iterations: int = Field(150, ge=0, description="Largest number of iterations of the first phase.")
    iterations: int = Field(
        60, ge=0, description="Largest number of iterations with all rows (0: only the first phase)."
    )
    refined_rows: PositiveInt | None = Field(None, description="Largest number of rows of the second phase; null: all.")
    refine_on: Literal["fitted", "every"] = Field(
        "fitted",
        description="`fitted`: the held-out records also stop the second phase. `every`: the second phase is trained "
        "on all records for `iterations` steps, because a held-out record is a condition without training. After the "
        "choice between the starts it need not be held out.",
    )
    averaged: int = Field(
        1,
        ge=1,
        description="Number of the best refined starts that are averaged into one network, which contains them in "
        "parallel. Errors "
        "that differ between single trainings partly cancel.",
    )
    held_out_share: float = Field(
        0.15,
        ge=0.0,
        lt=0.9,
        description="Share of the training records that are held out for early stopping and for the choice between "
        "starts.",
    )
    weight_decay: float = Field(
        0.0,
        ge=0.0,
        description="Penalty on the squared weights, added to the mean squared normalised error; 1e-6 to 1e-4 smooths "
        "a network between the few drive levels of a campaign. The thesis has no penalty.",
    )
    held_out_failures: int = Field(
        _TRAINLM.held_out_failures,
        ge=1,
        description="Number of consecutive iterations without improvement on the held-out records after which the "
        "training ends (trainlm: max_fail).",
    )
    gradient_tolerance: float = Field(
        _TRAINLM.gradient, ge=0.0, description="Gradient at which the training ends (trainlm: min_grad)."
    )
    improvement_tolerance: float = Field(
        _TRAINLM.improvement,
        ge=0.0,
        description="Relative improvement over ten iterations below which the training ends (0: no such limit, as in "
        "trainlm).",
    )
    mu: float = Field(_TRAINLM.mu, gt=0.0, description="Initial damping (trainlm: mu).")
    mu_increase: float = Field(
        _TRAINLM.mu_increase, gt=1.0, description="Factor of the damping after a failed step (trainlm: mu_inc)."
    )
    mu_decrease: float = Field(
        _TRAINLM.mu_decrease,
        gt=0.0,
        lt=1.0,
        description="Factor of the damping after a successful step (trainlm: mu_dec).",
    )
    mu_maximum: float = Field(
        _TRAINLM.mu_maximum, gt=0.0, description="Damping at which the training ends (trainlm: mu_max)."
    )

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
        description="Amplitude of the sinusoidal motion; null: the 95th percentile of the displacement of the "
        "campaign.",
    )
    frequency_hz: float = Field(1.0, gt=0.0, description="Its frequency.")
    damping_n_s_m: float | None = Field(
        None,
        gt=0.0,
        description="Viscous coefficient; by default the one whose peak force is half the largest of the campaign.",
    )


class InverseTrainingOptions(TrainingOptions):
    """Options of the training of the inverse network (force to drive)."""

    architecture: Literal["thesis", "sweep"] | tuple[PositiveInt, ...] = Field(
        (12, 6),
        description="Hidden layers: the neurons of each, `sweep` (what the sweep chose for the forward network, "
        "with its past values and biases), or `thesis` (two layers of six).",
    )
    biases: bool = Field(
        True,
        description="Whether the network has biases. The thesis has none. With absolute values as inputs the drive is "
        "not an odd function of them, and without biases it is zero at zero force, although the damper has a residual "
        "force there.",
    )
    starts: int = Field(
        6, ge=1, description="Number of random starts; the best ones on held-out records are trained further."
    )
    refined_starts: int = Field(4, ge=1, description="Number of the best starts that are trained further.")
    averaged: int = Field(
        4,
        ge=1,
        description="Number of the best refined starts that are averaged into one network, which contains them in "
        "parallel. Errors "
        "that differ between single trainings partly cancel.",
    )
    subsample_rows: int = Field(8000, ge=100, description="Number of rows of the first phase.")
    subsample_iterations: int = Field(120, ge=0, description="Largest number of iterations of the first phase.")
    refined_rows: PositiveInt | None = Field(
        40000, description="Largest number of rows of the second phase; null: all."
    )
    refine_on: Literal["fitted", "every"] = Field(
        "every",
        description="`every`: the second phase is trained on all records for `iterations` steps, because a held-out "
        "record is a condition without training. After the choice between the starts it need not be held out. "
        "`fitted`: "
        "the held-out records also stop the second phase.",
    )
    iterations: int = Field(
        160, ge=0, description="Largest number of iterations of the second phase (0: only the first phase)."
    )
    held_out_failures: int = Field(
        30,
        ge=1,
        description="Number of consecutive iterations without improvement on the held-out records after which the "
        "first phase ends. With the value 6 of trainlm it would end on a plateau.",
    )

    compare_signed: bool = Field(
        True,
        description="Whether a second network is trained briefly on signed values, to compare the share of negative "
        "drive.",
    )
    viscous: ViscousEmulationOptions = Field(ViscousEmulationOptions(), description="The emulation of viscous damping.")
