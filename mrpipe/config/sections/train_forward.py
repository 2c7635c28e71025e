"""Settings of `train-forward`."""

from __future__ import annotations

from mrpipe.config.sections._training import TrainingSettings


class TrainForwardSettings(TrainingSettings):
    """How the forward network (drive to force) is trained."""
