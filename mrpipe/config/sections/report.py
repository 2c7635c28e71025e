"""Settings of the report."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.options import Section


class ReportSettings(Section):
    """Content of the report."""

    title: str = Field("", description="Title of the report; empty: the name of the configuration.")
    formats: tuple[Literal["html", "markdown"], ...] = Field(
        ("html", "markdown"), description="Files to write: html (one file that opens offline), markdown."
    )
