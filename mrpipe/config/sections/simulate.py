"""Settings of `simulate`."""

from mrpipe.simulation.settings import SimulateSettings

__all__ = ["SimulateSettings"]
