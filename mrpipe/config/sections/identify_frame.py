"""Settings of the stage `identify-frame`."""

from __future__ import annotations

from pydantic import Field

from mrpipe.modal.options import IdentificationOptions
from mrpipe.options import Section


class IdentifyFrameSettings(Section, IdentificationOptions):
    """Identification of the frame from its forced, ambient and decay tests."""

    mode_matrix: str = Field(
        "",
        description="Mode shapes to use instead of the measured ones: a parameter set in configs/frames or a YAML "
        "file; empty: the measured ones.",
    )
    segment_s: float = Field(
        16.0, gt=0.0, description="Length of a segment of the averaged frequency responses that the report shows."
    )
