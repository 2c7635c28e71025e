"""Base of all options: of the domain's functions and, as sections, of the configuration.

A package declares the options of its functions in one class with one set of defaults. The section of the configuration
is that class, so a call from a notebook does what the stage does.
"""

from __future__ import annotations

from types import UnionType
from typing import Any, Self, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator


def _kinds(annotation: Any) -> set[Any]:
    """Return the types of a type annotation: itself, or those of a union."""
    is_union = get_origin(annotation) in {Union, UnionType}
    return {kind for part in get_args(annotation) for kind in _kinds(part)} if is_union else {annotation}


class Section(BaseModel):
    """A group of settings: unknown keys are refused, values are checked, finite and frozen, every field is described.

    A field's name carries its unit as a suffix (`cutoff_hz`); its description is what `mrpipe check --explain` prints
    and what the documentation quotes.
    """

    model_config = ConfigDict(
        extra="forbid", frozen=True, validate_default=True, use_attribute_docstrings=False, allow_inf_nan=False
    )

    @field_validator("*", mode="before")
    @classmethod
    def _true_is_no_number(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse true and false for a number, which they would be otherwise: 1 and 0."""
        kinds = _kinds(cls.model_fields[str(info.field_name)].annotation)
        if isinstance(value, bool) and kinds & {int, float} and bool not in kinds:
            raise ValueError("a number expected")
        return value

    def changed(self, **changes: Any) -> Self:
        """Return the same options with some values changed, checked like the others."""
        return type(self)(**{name: getattr(self, name) for name in type(self).model_fields} | changes)
