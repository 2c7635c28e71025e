"""Execution of the program; these settings change no result."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class ExecutionSettings(Section):
    """Settings that change how the program runs and no result: they are part of no stage's key."""

    jobs: int = Field(
        0,
        ge=0,
        description="Largest number of processes of a stage; 0: one per core. With more than one process, `mrpipe "
        "run` runs two stages at a time if neither needs the other.",
    )
    log_level: Literal["debug", "info", "warning"] = Field(
        "info", description="Level of messages in the log file and on standard error: debug, info or warning."
    )
