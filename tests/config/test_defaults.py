"""A default exists once: options of the domain take the defaults that they share with settings from these."""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mrpipe.config.model import sections
from mrpipe.options import Section

pytestmark = pytest.mark.property

PACKAGE = Path(__file__).resolve().parents[2] / "mrpipe"

OF_CLASS, OF_FUNCTION = 2, 3
"""Equal literal defaults of the same name that make a dataclass or a function the twin of a section."""

DRIFTED = 4
"""Fields of the same name that make a dataclass the twin of a section even if the defaults differ."""

TRIVIAL: tuple[Any, ...] = (None, True, False, "", (), {}, 0)
"""Defaults that mean nothing by themselves."""


def _literal(node: ast.expr | None) -> Any:
    """Return the value of a literal; None for an expression, which takes the default from elsewhere."""
    if node is None:
        return None
    try:
        return ast.literal_eval(node)
    except ValueError:
        return None


def _known(pairs: Iterator[tuple[str, Any]]) -> dict[str, Any]:
    return {name: value for name, value in pairs if not any(value == item for item in TRIVIAL)}


def _of_class(node: ast.ClassDef) -> dict[str, Any]:
    fields = (item for item in node.body if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name))
    return _known((item.target.id, _literal(item.value)) for item in fields if isinstance(item.target, ast.Name))


def _of_function(node: ast.FunctionDef) -> dict[str, Any]:
    given = [*node.args.posonlyargs, *node.args.args]
    pairs = [
        *zip(given[::-1], node.args.defaults[::-1], strict=False),
        *zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True),
    ]
    return _known((argument.arg, _literal(default)) for argument, default in pairs)


def _declared() -> Iterator[tuple[str, dict[str, Any], int]]:
    """Yield every dataclass and function of the package with its literal defaults, and how many make it a twin."""
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and "dataclass" in "".join(map(ast.unparse, node.decorator_list)):
                yield f"{name}:{node.name}", _of_class(node), OF_CLASS
            elif isinstance(node, ast.FunctionDef):
                yield f"{name}:{node.name}()", _of_function(node), OF_FUNCTION


def _nested(model: type[Section]) -> Iterator[type[Section]]:
    yield model
    for field in model.model_fields.values():
        for inner in (field.annotation, *getattr(field.annotation, "__args__", ())):
            if inspect.isclass(inner) and issubclass(inner, Section):
                yield from _nested(inner)


@functools.cache
def _nodes(path: str) -> list[ast.AST]:
    return list(ast.walk(ast.parse(Path(path).read_text(encoding="utf-8"))))


def _is_literal(model: type[Section], field: str) -> bool:
    """Return whether the source of a section states the default of a field; else it refers to another place."""
    owner = next(item for item in model.__mro__ if field in inspect.get_annotations(item))
    for node in _nodes(inspect.getsourcefile(owner) or ""):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.target.id == field:
            call = node.value
            if isinstance(call, ast.Call) and call.args and _literal(call.args[0]) == model.model_fields[field].default:
                return True
    return False


def _settings() -> dict[str, dict[str, Any]]:
    models = {item for section in sections().values() for item in _nested(section)}
    return {
        item.__name__: {key: field.default for key, field in item.model_fields.items() if _is_literal(item, key)}
        for item in models
        if item.__module__ != "pydantic.main"
    }


def twins(known: dict[str, Any], settings: dict[str, dict[str, Any]], equal: int) -> list[str]:
    """Return the sections that hold the same defaults as a dataclass or function."""
    found = []
    for name, section in settings.items():
        shared = [key for key in known if key in section]
        same = [key for key in shared if section[key] == known[key]]
        if len(same) >= equal or len(shared) >= max(DRIFTED, equal + 2):
            found.append(f"{name}: {', '.join(shared)}")
    return found


def test_the_search_finds_twins() -> None:
    settings = {"A": {"rate_hz": 200.0, "starts": 4, "jobs": 1, "folds": 3}}
    assert twins({"rate_hz": 200.0, "starts": 4}, settings, OF_CLASS) == ["A: rate_hz, starts"]
    assert twins({"rate_hz": 200.0, "starts": 5}, settings, OF_CLASS) == []
    assert twins({"rate_hz": 1.0, "starts": 2, "jobs": 3, "folds": 4}, settings, OF_CLASS) != []
    source = "@dataclass\nclass B:\n    starts: int = _SETTINGS.starts\n    rate_hz: float = 200.0"
    assert _of_class(ast.parse(source).body[0]) == {"rate_hz": 200.0}  # type: ignore[arg-type]


def test_no_default_exists_twice() -> None:
    settings = _settings()
    assert len(settings) > 30
    found = {name: twins(known, settings, equal) for name, known, equal in _declared()}
    assert {name: items for name, items in found.items() if items} == {}
