"""Base of all options: of the domain's functions and, as sections, of the configuration.

A package declares the options of its functions in one class with one set of defaults. The section of the configuration
is that class, so a call from a notebook does what the stage does.
"""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A group of settings: unknown keys are refused, values are checked and frozen, every field is described.

    A field's name carries its unit as a suffix (`cutoff_hz`); its description is what `mrpipe check --explain` prints
    and what the documentation quotes.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True, use_attribute_docstrings=False)

    def changed(self, **changes: Any) -> Self:
        """Return the same options with some values changed, checked like the others."""
        return type(self)(**{name: getattr(self, name) for name in type(self).model_fields} | changes)
