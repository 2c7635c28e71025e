"""Settings of `sweep`."""

from __future__ import annotations

from mrpipe.networks.options import SweepOptions


class SweepSettings(SweepOptions):
    """Architectures of the forward network that are compared, and their training."""
