"""Settings of the tracing of residuals (`close-loop`)."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, field_validator

from mrpipe.control.laws import known_law
from mrpipe.tracing.options import TracingSettings


class CloseLoopSettings(TracingSettings):
    """From the residual of a model to the effect that it lacks."""

    candidates: tuple[str, ...] = Field((), description="Effects to consider; empty for all of the library.")
    effect_files: tuple[Path, ...] = Field(
        (), description="Your Python files, each of which defines one more effect as EFFECT."
    )
    laws: tuple[str, ...] = Field(
        (),
        description="Laws that the closed loop compares in addition to the recorded ones; empty: those that `stages` "
        "simulates, or all that are calibrated where it simulates none.",
    )

    @field_validator("laws")
    @classmethod
    def _laws_are_known(cls, laws: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(known_law(law) for law in laws)
