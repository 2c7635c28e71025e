"""What is printed on standard output: one JSON document, or a few lines for a person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_WIDEST = 8


def print_json(content: Any) -> None:
    """Print one strict JSON document; characters that standard output cannot show are written as JSON escapes."""
    import sys

    from mrpipe.artifacts.plain import to_json

    text = to_json(content)
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        import json

        text = json.dumps(json.loads(text), indent=2)
    print(text)


def print_summary(title: str, summary: Mapping[str, Any], warnings: Sequence[str] = ()) -> None:
    """Print the summary of a stage, one line per entry; long lists are shortened (--json prints all of them)."""
    print(title)
    for key, value in summary.items():
        for line in _lines(key, value, 1):
            print(line)
    for warning in warnings:
        print(f"  warning: {warning}")


def print_brief(title: str, lines: Sequence[str], warnings: Sequence[str] = ()) -> None:
    """Print the result of a stage in a few lines; --json prints all of its numbers."""
    print(title)
    for line in lines:
        print(f"  {line}")
    for warning in warnings:
        print(f"  warning: {warning}")


def _lines(key: str, value: Any, depth: int) -> list[str]:
    margin = "  " * depth
    if isinstance(value, Mapping):
        if not value:
            return [f"{margin}{key}: -"]
        inner = [line for name, item in value.items() for line in _lines(str(name), item, depth + 1)]
        flat = ", ".join(f"{name} {_short(item)}" for name, item in value.items())
        if len(flat) <= 90 and not any(isinstance(item, Mapping | list) for item in value.values()):
            return [f"{margin}{key}: {flat}"]
        return [f"{margin}{key}:", *inner]
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        rows = [f"{margin}  - " + ", ".join(f"{name} {_short(item)}" for name, item in row.items()) for row in value]
        return [f"{margin}{key}:", *rows[: 2 * _WIDEST]]
    if isinstance(value, list) and value and isinstance(value[0], list):
        return [f"{margin}{key}:", *(f"{margin}  {_short(row)}" for row in value)]
    return [f"{margin}{key}: {_short(value)}"]


def _short(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "-"}[value]
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        shown = " ".join(_short(item) for item in value[:_WIDEST])
        return shown + (" …" if len(value) > _WIDEST else "")
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name} {_short(item)}" for name, item in value.items()) + "}"
    return str(value)
