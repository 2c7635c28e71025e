"""Settings of `simulate --resonance`."""

from mrpipe.simulation.settings import ResonanceSettings

__all__ = ["ResonanceSettings"]
