"""Settings of the stage `reproduce`: a section of the configuration."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class ReproduceSettings(Section):
    """Results of the thesis that are recomputed, and the data that are used."""

    source: Literal["run", "sets"] = Field(
        "run",
        description="`run`: the frame, damper, networks and responses of this run; what is missing is built first. "
        "`sets`: the printed frame, damper set C and its exact inverse, without a run; fewer results can be "
        "recomputed then.",
    )
    chapters: tuple[Literal[2, 3, 4, 5, 6], ...] = Field(
        (2, 3, 4, 5, 6), min_length=1, description="Chapters of the thesis whose results are recomputed."
    )
    frame: str = Field(
        "thesis",
        description="Printed frame, from which closed forms and the checks are recomputed: a set in configs/frames or "
        "a YAML file.",
    )
