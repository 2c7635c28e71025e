"""Settings of `train-inverse`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, PositiveInt

from mrpipe.config.section import Section
from mrpipe.config.sections._training import TrainingSettings


class ViscousEmulationSettings(Section):
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


class TrainInverseSettings(TrainingSettings):
    """How the inverse network (force to drive) is trained."""

    architecture: Literal["thesis", "sweep"] | tuple[PositiveInt, ...] = Field(
        (12, 6),
        description="Hidden layers: the neurons of each (those of P5 by default), `thesis` (two of six), or `sweep` "
        "(what the sweep chose for the forward network, its past values and biases included).",
    )
    biases: bool = Field(
        True,
        description="Biases are trained. The thesis has none; but on absolute values the drive is no odd function, and "
        "without them it is bound to zero at zero force, where the damper holds its residual force.",
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
    viscous: ViscousEmulationSettings = Field(
        ViscousEmulationSettings(), description="The emulation of viscous damping."
    )
