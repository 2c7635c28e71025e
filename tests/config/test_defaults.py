"""A default exists once: settings that a function of the domain also has carry the same default there."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from typing import Any

import pytest

from mrpipe.config.model import sections
from mrpipe.options import Section

pytestmark = pytest.mark.property

PACKAGE = Path(__file__).resolve().parents[2] / "mrpipe"
SHARED = 4
"""Fields of the same name from which a section and an options class are taken to mean the same."""


def _options_classes() -> dict[str, dict[str, Any]]:
    """Return class -> field -> default of every options class that is a dataclass, from its source."""
    found: dict[str, dict[str, Any]] = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and node.name.endswith("Options") and node.decorator_list:
                found[f"{path.relative_to(PACKAGE)}:{node.name}"] = _defaults(node)
    return found


def _defaults(node: ast.ClassDef) -> dict[str, Any]:
    defaults = {}
    for item in node.body:
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name) and item.value is not None:
            try:
                defaults[item.target.id] = ast.literal_eval(item.value)
            except ValueError:
                continue  # a default that is computed, such as a factory
    return defaults


def _nested(model: type[Section]) -> list[type[Section]]:
    inner = [field.annotation for field in model.model_fields.values()]
    below = [item for item in inner if inspect.isclass(item) and issubclass(item, Section)]
    return [model, *(found for item in below for found in _nested(item))]


def test_no_setting_has_another_default_in_the_domain() -> None:
    models = [item for section in sections().values() for item in _nested(section)]
    drifted = []
    for name, known in _options_classes().items():
        for model in models:
            shared = [key for key in known if key in model.model_fields]
            drifted += [
                f"{model.__name__}.{key}: {model.model_fields[key].default!r}, {name}: {known[key]!r}"
                for key in shared
                if len(shared) >= SHARED and model.model_fields[key].default not in (known[key], None)
            ]
    assert drifted == []
