"""Settings of `mrpipe design`."""

from mrpipe.design.options import DesignSettings

__all__ = ["DesignSettings"]
