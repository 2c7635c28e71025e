"""Settings of `export controller`."""

from __future__ import annotations

from pydantic import Field, field_validator

from mrpipe.config.section import Section
from mrpipe.control.laws import known_law, law_names


class ExportSettings(Section):
    """The controller as C; how it runs is what simulate.controller says."""

    law: str = Field("fdns", description=f"Control law to be exported: {', '.join(law_names())}.")
    prefix: str = Field("mrpipe", pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", description="Prefix of the C function names.")

    @field_validator("law")
    @classmethod
    def _known(cls, law: str) -> str:
        return known_law(law)
