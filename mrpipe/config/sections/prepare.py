"""Settings of the stage `prepare`."""

from __future__ import annotations

from mrpipe.signals.options import PreparationOptions


class PrepareSettings(PreparationOptions):
    """How measured tests are filtered, freed of offsets and differentiated."""
