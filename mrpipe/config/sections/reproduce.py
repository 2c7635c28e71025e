"""Settings of the stage `reproduce`."""

from mrpipe.thesis.options import ReproduceSettings

__all__ = ["ReproduceSettings"]
