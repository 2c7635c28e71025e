"""Settings of `mrpipe design`."""

from mrpipe.law_design.options import DesignSettings

__all__ = ["DesignSettings"]
