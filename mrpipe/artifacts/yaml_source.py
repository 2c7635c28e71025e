"""YAML with line numbers, and messages that name the line and the nearest known key."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from mrpipe.errors import UserError

Place = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)


def nearest(word: str, known: Iterable[str]) -> str:
    """Return a remedy that names the known words, the likeliest first."""
    words = sorted(known)
    close = difflib.get_close_matches(str(word), words, n=1, cutoff=0.5)
    if close:
        return f"did you mean {close[0]}?"
    return f"known: {', '.join(words)}" if words else "there are none"


@dataclass(frozen=True)
class YamlSource:
    """A YAML file: its content, and on which line each key stands."""

    path: Path
    content: dict[str, Any]
    lines: Mapping[Place, int] = field(default_factory=dict)

    def where(self, place: Place) -> str:
        """Return `line 12, tests[3].role` for a place such as `("tests", 3, "role")`."""
        text = ""
        for part in place:
            text += f"[{part}]" if isinstance(part, int) else f"{'.' if text else ''}{part}"
        for length in range(len(place), 0, -1):
            if place[:length] in self.lines:
                return f"line {self.lines[place[:length]]}, {text}"
        return text

    def error(self, place: Place, problem: str, remedy: str) -> UserError:
        """Return the error that names this file and place."""
        return UserError(self.path, self.where(place), problem, remedy)

    def build(self, model: type[Model], content: Any, place: Place) -> Model:
        """Validate `content` as `model`; the first fault is told with its line.

        Raises
        ------
        UserError
            If a key is unknown (with the nearest known one), missing, or its value does not fit.
        """
        if not isinstance(content, Mapping):
            raise self.error(place, f"is {content!r}", "a mapping of keys to values expected")
        try:
            return model.model_validate(dict(content))
        except ValidationError as error:
            first = sorted(error.errors(), key=lambda item: item["type"] != "extra_forbidden")[0]
            key = (*place, *first["loc"])
            if first["type"] == "extra_forbidden":
                raise self.error(key, "unknown key", nearest(str(first["loc"][-1]), model.model_fields)) from None
            if first["type"] == "missing":
                raise self.error(key, "is missing", f"write {first['loc'][-1]}: ... here") from None
            raise self.error(key, f"is {first['input']!r}", first["msg"].removeprefix("Value error, ")) from None


def read_yaml(path: Path) -> YamlSource:
    """Read a YAML mapping with the safe loader only.

    Raises
    ------
    UserError
        If the file is missing, not YAML, no mapping, or holds a key twice.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise UserError(path, "", "cannot be read", "name a YAML file that is there") from error
    except UnicodeDecodeError as error:
        raise UserError(path, "", "is not UTF-8 text", "save it as UTF-8") from error
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error)
        raise UserError(path, where, f"not valid YAML ({problem})", "mend the syntax") from error
    if not isinstance(content, dict):
        raise UserError(path, "line 1", "is no mapping", "write `key: value` lines")
    lines: dict[Place, int] = {}
    _collect_lines(node, (), lines, Path(path))
    return YamlSource(Path(path), content, lines)


def _collect_lines(node: Any, place: Place, lines: dict[Place, int], path: Path) -> None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            inner = (*place, str(key.value))
            line = key.start_mark.line + 1
            if inner in lines:
                dotted = ".".join(str(part) for part in inner)
                problem = f"stands already in line {lines[inner]}"
                raise UserError(path, f"line {line}, {dotted}", problem, "keep one of the two")
            lines[inner] = line
            _collect_lines(value, inner, lines, path)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            inner_index: Place = (*place, index)
            lines[inner_index] = value.start_mark.line + 1
            _collect_lines(value, inner_index, lines, path)
