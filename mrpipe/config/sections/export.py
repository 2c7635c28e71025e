"""Settings of `export`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from mrpipe.control.laws import known_law, law_names
from mrpipe.options import Section


class ExportSettings(Section):
    """Models and controllers for other programs; `simulate.controller` sets how a controller runs."""

    law: str = Field("fdns", description=f"Control law to be exported: {', '.join(law_names())}.")
    prefix: str = Field("mrpipe", pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", description="Prefix of the C function names.")
    formats: tuple[Literal["c", "json", "matlab", "onnx"], ...] = Field(
        (),
        description="Formats of exported models; `onnx` for networks only. Empty: all that are possible. "
        "Controllers are always C and JSON.",
    )
    frame_rate_hz: float = Field(1000.0, gt=0.0, description="Rate of the steps of an exported frame.")

    @field_validator("law")
    @classmethod
    def _known(cls, law: str) -> str:
        return known_law(law)
