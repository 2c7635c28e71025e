"""Settings of `train-inverse`."""

from __future__ import annotations

from pydantic import Field

from mrpipe.config.section import Section
from mrpipe.config.sections.training import TrainingSettings


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

    compare_signed: bool = Field(
        True, description="Train a short second network on signed values, to compare the share of negative drive."
    )
    viscous: ViscousEmulationSettings = Field(
        ViscousEmulationSettings(), description="The emulation of viscous damping."
    )
