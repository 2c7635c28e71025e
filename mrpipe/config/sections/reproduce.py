"""Settings of the stage `reproduce`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.config.section import Section


class ReproduceSettings(Section):
    """Which printed figures are recomputed, and with which parameter sets."""

    chapters: tuple[Literal[2, 3, 4, 5, 6], ...] = Field(
        (2, 3, 4, 5, 6), description="Chapters of the thesis whose printed figures are recomputed."
    )
    frame: str = Field("thesis", description="Frame of chapters 3 to 5: a set in configs/frames or a YAML file.")
    duration_s: float = Field(
        60.0, ge=10.0, description="Length of each closed-loop run of chapter 5; its second half is evaluated."
    )
