"""Settings of `sweep`."""

from __future__ import annotations

from mrpipe.networks.options import SweepOptions


class SweepSettings(SweepOptions):
    """Which architectures of the forward network are compared, and how long each is trained."""
