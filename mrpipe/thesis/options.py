"""Settings of `reproduce`: a section of the configuration, and the options of :mod:`mrpipe.thesis.collect`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class ReproduceSettings(Section):
    """Which printed figures are recomputed, and with which parameter sets."""

    chapters: tuple[Literal[2, 3, 4, 5, 6], ...] = Field(
        (2, 3, 4, 5, 6), description="Chapters of the thesis whose printed figures are recomputed."
    )
    frame: str = Field("thesis", description="Frame of chapters 3 to 5: a set in configs/frames or a YAML file.")
    duration_s: float = Field(
        60.0, ge=10.0, description="Length of each closed-loop run of chapter 5; its second half is evaluated."
    )
