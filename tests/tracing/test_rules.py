"""Every threshold of the tracing is a rule that settings can change; no other module of the package holds one."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from mrpipe.config.model import options
from mrpipe.tracing.rules import DelayRules, TracingRules

pytestmark = pytest.mark.property

PACKAGE = Path(__file__).resolve().parents[2] / "mrpipe" / "tracing"
NEUTRAL = {0.0, 1.0, 2.0, 0.5}
"""Numbers that need no reason in a comparison."""

GUARD = 1e-6
"""Smaller numbers protect a division or a logarithm."""

TECHNIQUE = "Numerical technique"
"""A number that decides nothing, such as the size of a grid, says so in its docstring."""


def _modules() -> list[Path]:
    found = {path.relative_to(PACKAGE).as_posix(): path for path in sorted(PACKAGE.rglob("*.py"))}
    return [path for name, path in found.items() if not name.startswith("rules/")]


def _numbers(node: ast.AST) -> Iterator[float]:
    for item in ast.walk(node):
        if isinstance(item, ast.Constant) and isinstance(item.value, int | float) and not isinstance(item.value, bool):
            yield abs(float(item.value))


def undeclared(source: str) -> list[str]:
    """Return the module-level numbers whose docstring does not say that they are numerical technique."""
    body = ast.parse(source).body
    found = []
    for item, following in zip(body, [*body[1:], None], strict=True):
        if (
            not isinstance(item, ast.Assign | ast.AnnAssign)
            or item.value is None
            or set(_numbers(item.value)) <= {0.0, 1.0}
        ):
            continue
        text = following.value if isinstance(following, ast.Expr) else None
        said = isinstance(text, ast.Constant) and str(text.value).startswith(TECHNIQUE)
        if not said:
            found.append(f"line {item.lineno}: {ast.unparse(item)}")
    return found


def compared(source: str) -> list[str]:
    """Return the comparisons with a number that is neither neutral nor a guard."""
    return [
        f"line {item.lineno}: {ast.unparse(item)}"
        for item in ast.walk(ast.parse(source))
        if isinstance(item, ast.Compare) and any(value not in NEUTRAL and value > GUARD for value in _numbers(item))
    ]


def test_the_search_finds_thresholds() -> None:
    assert undeclared("LEAST = 0.3\n'''Share.'''") == ["line 1: LEAST = 0.3"]
    assert undeclared("GRID = (0.1, 0.3)\n'''Numerical technique: grid.'''\nNAME = 'x'") == []
    assert compared("def f(x):\n    return x > 0.3 or x < 5") == ["line 2: x > 0.3", "line 2: x < 5"]
    assert compared("def f(x):\n    return x > 0.0 and x < 1e-12 and x - 0.5 > 1.0") == []


@pytest.mark.parametrize("path", _modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_no_threshold_outside_the_rules(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    assert undeclared(source) == []
    assert compared(source) == []


def test_every_rule_is_a_setting_with_a_reason() -> None:
    texts = {name: text for name, text, _ in options() if name.startswith("close_loop.rules.")}
    sections = {name: field.annotation for name, field in TracingRules.model_fields.items()}
    for name, section in sections.items():
        for field in section.model_fields:
            assert len(texts[f"close_loop.rules.{name}.{field}"].split()) > 8, f"{name}.{field}"
    assert TracingRules(delay={"better": 0.7}).delay == DelayRules(better=0.7)
