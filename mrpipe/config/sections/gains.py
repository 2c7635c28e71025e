"""Settings of the gains that the control laws run with."""

from __future__ import annotations

from pydantic import Field

from mrpipe.control.gains import GainsSource
from mrpipe.options import Section


class GainsSettings(Section):
    """Gains of the control laws in `simulate` and `export`."""

    source: GainsSource = Field(
        "calibrated", description="`calibrated`: those of calibrate; `design`: the best ones that design found."
    )
