"""Settings of the stage `prepare`."""

from __future__ import annotations

from mrpipe.signals.options import PreparationOptions


class PrepareSettings(PreparationOptions):
    """Filtering of measured tests, removal of offsets, and differentiation."""
