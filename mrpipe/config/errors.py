"""Turns what pydantic finds into one line with file, line, key and the nearest known key."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from mrpipe.artifacts.yaml_source import KINDS, dotted, expected, nearest, shown
from mrpipe.errors import UserError


def section_of(model: type[BaseModel], path: tuple[str | int, ...]) -> type[BaseModel] | None:
    """Return the model that the keys of `path` lead to, or None where they leave the models."""
    current: type[BaseModel] | None = model
    for key in path:
        if current is None or key not in current.model_fields:
            return None
        current = model_in(current.model_fields[str(key)].annotation)
    return current


def model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the model that a type annotation holds (itself, in a tuple, dict or union), or None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        found = model_in(argument)
        if found is not None:
            return found
    return None


def _finding(error: ValidationError) -> tuple[Any, tuple[str | int, ...]]:
    """Return the first finding and its keys; where a value may be of several kinds, that of the kind it comes nearest.

    pydantic reports every kind and puts its name among the keys, such as `tuple[int,...]` or, last, `str`: no key of
    the user's.
    """
    found = [(item, _without_kinds(item["loc"])) for item in error.errors()]
    first = found[0][1]
    return max((entry for entry in found if entry[1][: len(first)] == first), key=lambda entry: len(entry[1]))


def _without_kinds(place: tuple[str | int, ...]) -> tuple[str | int, ...]:
    keys = tuple(key for key in place if "[" not in str(key))
    # a name of a kind after an index, because a setting may be called `float`, but no entry of a list
    return keys[:-1] if len(keys) > 1 and keys[-1] in KINDS and isinstance(keys[-2], int) else keys


def explain(
    error: ValidationError,
    model: type[BaseModel],
    source: str | Path,
    lines: Mapping[tuple[str | int, ...], int],
) -> UserError:
    """Return the first finding of `error` as a :class:`UserError`.

    Parameters
    ----------
    error
        The error that pydantic raised.
    model
        The model that was validated.
    source
        File, or `--set`.
    lines
        Path of keys -> line number in the file.
    """
    first, path = _finding(error)
    known_path = path
    while known_path and known_path not in lines:
        known_path = known_path[:-1]
    line = lines.get(known_path)
    where = f"line {line}, {dotted(path)}" if line else dotted(path)
    if first["type"] == "extra_forbidden":
        section = section_of(model, path[:-1])
        known = list(section.model_fields) if section is not None else []
        return UserError(source, where, "unknown key", nearest(str(path[-1]), known))
    if first["type"] == "invalid_key":
        remedy = "write a name; a decimal number has a point and no comma, as in 12.5"
        return UserError(source, where, f"{shown(path[-1])} is a number in place of a name", remedy)
    if first["type"] == "missing":
        return UserError(source, where, "is missing", "give this setting")
    given = first.get("input")
    problem = f"is {shown(given)}" if not isinstance(given, Mapping) else "is a section with settings"
    return UserError(source, where, problem, expected(first))
