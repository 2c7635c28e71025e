"""Base of every configuration section."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A group of settings: unknown keys refused, frozen once read, every field described.

    A field's name carries its unit as a suffix (`cutoff_hz`); its description is what `mrpipe check --explain` prints
    and what the documentation quotes.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True, use_attribute_docstrings=False)
