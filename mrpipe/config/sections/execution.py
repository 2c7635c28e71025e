"""How the program runs; nothing here changes a result."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class ExecutionSettings(Section):
    """Settings that change how the program runs and no result: they are part of no stage's key."""

    jobs: int = Field(
        0,
        ge=0,
        description="Processes that a stage uses at most; 0 means one for each core. With more than one, `mrpipe run` "
        "runs two stages at a time where neither needs the other.",
    )
    log_level: Literal["debug", "info", "warning"] = Field(
        "info", description="How much the log file and standard error say: debug, info or warning."
    )
