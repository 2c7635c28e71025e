"""Settings of `train-inverse`."""

from __future__ import annotations

from mrpipe.networks.options import InverseTrainingOptions


class TrainInverseSettings(InverseTrainingOptions):
    """Training of the inverse network (motion and force to drive)."""
