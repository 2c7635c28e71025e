"""What is printed on standard output: one JSON document, or a few lines for a person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_WIDEST = 8

_LINE = 118
"""Longest line of a table, in characters."""

_UNITS = {
    "_n_s_m": "N s/m",
    "_rad_s": "rad/s",
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_n_m": "N/m",
    "_percent": "%",
    "_hz": "Hz",
    "_kg": "kg",
    "_j": "J",
    "_m": "m",
    "_n": "N",
    "_s": "s",
}
"""Ends of keys that are units."""


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
    """Return the lines of one entry; `key` is a key of a summary or the name of a parameter."""
    margin, title = "  " * depth, _title(key)
    if isinstance(value, Mapping):
        if not value:
            return [f"{margin}{title}: -"]
        if len(value) > 1 and all(_is_row(item) for item in value.values()):
            rows = [{"": name, **item} for name, item in value.items()]
            return [f"{margin}{title}:", *_table(rows, f"{margin}  ")]
        inner = [line for name, item in value.items() for line in _lines(str(name), item, depth + 1)]
        flat = ", ".join(f"{_title(name)} {_short(item)}" for name, item in value.items())
        if len(flat) <= 90 and not any(isinstance(item, Mapping | list) for item in value.values()):
            return [f"{margin}{title}: {flat}"]
        return [f"{margin}{title}:", *inner]
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        more = len(value) - 2 * _WIDEST
        omitted = [f"{margin}  … {more} more rows (--json prints all of them)"] if more > 0 else []
        return [f"{margin}{title}:", *_table(value[: 2 * _WIDEST], f"{margin}  "), *omitted]
    if isinstance(value, list) and value and isinstance(value[0], list):
        return [f"{margin}{title}:", *(f"{margin}  {_short(row)}" for row in value)]
    return [f"{margin}{title}: {_short(value) or '-'}"]


def _is_row(value: Any) -> bool:
    """Return whether a mapping holds single values, or mappings of them."""
    if not isinstance(value, Mapping):
        return False
    inner = [part for item in value.values() if isinstance(item, Mapping) for part in item.values()]
    return not any(isinstance(part, Mapping) for part in inner)


def _title(key: str) -> str:
    """Return a key in words: `force_peak_n` is `force peak [N]`."""
    for suffix, unit in _UNITS.items():
        if key.endswith(suffix) and key != suffix.lstrip("_"):
            return f"{_title(key.removesuffix(suffix))} [{unit}]"
    return " ".join("NRMSE" if word == "nrmse" else word for word in key.split("_"))


def _table(rows: Sequence[Mapping[str, Any]], margin: str) -> list[str]:
    """Return rows with the same keys as a table, without empty columns; a wide table has several parts."""
    flat = [_flat(row) for row in rows]
    names = [name for name in dict.fromkeys(name for row in flat for name in row) if any(row.get(name) for row in flat)]
    columns = []
    for name in names:
        cells = [_title(name), *(row.get(name, "") or "-" for row in flat)]
        width = max(map(len, cells))
        columns.append([cell.ljust(width) for cell in cells])
    parts: list[list[list[str]]] = []
    for column in columns[1:]:
        if not parts or sum(len(item[0]) + 2 for item in (*parts[-1], column)) > _LINE - len(margin):
            parts.append([columns[0]])
        parts[-1].append(column)
    return [
        f"{margin}{'  '.join(cells)}".rstrip() for part in parts or [columns[:1]] for cells in zip(*part, strict=True)
    ]


def _flat(row: Mapping[str, Any]) -> dict[str, str]:
    """Return the cells of a row as texts, empty if there is no value; those of a nested mapping have both keys."""
    cells: dict[str, str] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            cells |= {f"{inner} {name}": _short(item) for inner, item in value.items()}
        else:
            cells[name] = "" if value is None else _short(value)
    return cells


def _short(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "-"}[value]
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        shown = " ".join(_short(item) for item in value[:_WIDEST])
        return shown + (" …" if len(value) > _WIDEST else "")
    if isinstance(value, Mapping):
        return ", ".join(f"{_title(str(name))} {_short(item)}" for name, item in value.items())
    return str(value)
