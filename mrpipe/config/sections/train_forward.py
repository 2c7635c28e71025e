"""Settings of `train-forward`."""

from __future__ import annotations

from mrpipe.networks.options import TrainingOptions


class TrainForwardSettings(TrainingOptions):
    """Training of the forward network (motion and drive to force)."""
