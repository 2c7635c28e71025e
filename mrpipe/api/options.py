"""Keyword arguments as settings, with the messages of the configuration."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from mrpipe.config.errors import explain

Model = TypeVar("Model", bound=BaseModel)


def settings_of(model: type[Model], name: str, given: dict[str, Any]) -> Model:
    """Return the settings of a section.

    Raises
    ------
    UserError
        If a keyword is not a setting of the section, or its value is not allowed.
    """
    try:
        return model(**given)
    except ValidationError as error:
        raise explain(error, model, name, {}) from None


def silent(fraction: float, text: str = "") -> None:
    """Take no notice of the progress."""
