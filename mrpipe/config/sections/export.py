"""Settings of `export controller`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.config.section import Section


class ExportSettings(Section):
    """The controller as C; how it runs is what simulate.controller says."""

    law: Literal["vd", "vdps", "vdns", "fdns", "nnc", "lqg", "passive-off", "passive-on"] = Field(
        "fdns", description="Control law to be exported."
    )
    prefix: str = Field("mrpipe", pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", description="Prefix of the C function names.")
