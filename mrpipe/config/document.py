"""Writes docs/configuration.md from the settings themselves: `python -m mrpipe.config.document`."""

from __future__ import annotations

import json
import sys
from typing import Any

from pydantic_core import PydanticUndefined

from mrpipe.config.model import options

_HEAD = """\
# Settings

Every setting, its default and its meaning; `mrpipe check --explain CONFIG` prints the same with the values of a
configuration. This page is written by `python -m mrpipe.config.document > docs/configuration.md`.
"""


def as_markdown() -> str:
    """Return the page."""
    lines = [_HEAD]
    for name, text, default in options():
        if hasattr(default, "model_dump"):
            depth = "#" * (2 + name.count("."))
            lines.append(f"\n{depth} {name}\n{text}\n\n| setting | default | meaning |\n| --- | --- | --- |\n")
        elif "." not in name:
            if name == "name":
                lines.append("\n## Settings of the whole run\n| setting | default | meaning |\n| --- | --- | --- |\n")
            lines.append(_row(name, default, text))
        else:
            lines.append(_row(name, default, text))
    return "".join(lines)


def _row(name: str, default: Any, text: str) -> str:
    shown = json.dumps(default, default=_plain, ensure_ascii=False).replace("|", chr(92) + "|")
    cell = "required" if default is PydanticUndefined else f"`{shown}`"
    return f"| `{name}` | {cell} | {text.replace('|', chr(92) + '|')} |\n"


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if hasattr(value, "model_dump") else str(value)


if __name__ == "__main__":
    sys.stdout.write(as_markdown())
