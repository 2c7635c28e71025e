"""Settings of the stage `identify-damper`."""

from mrpipe.fitting.settings import IdentifyDamperSettings

__all__ = ["IdentifyDamperSettings"]
