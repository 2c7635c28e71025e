"""Writes docs/command-line.md from the commands themselves: `python -m mrpipe.cli.document > docs/command-line.md`."""

from __future__ import annotations

import sys
from typing import Any

import typer
from typer.main import get_command

_HEAD = """\
# Command line

Every command with its arguments and options. `mrpipe COMMAND --help` prints the same. This page is written by
`python -m mrpipe.cli.document > docs/command-line.md`.

Exit status: 0 done; 1 a check or a part of the command failed; 2 the input is wrong, and one line says which
file, which key or row, what is wrong and what would be right; 130 interrupted.
"""
_COMMON_HEAD = """
## Common options

Most commands have these options. The table of a command lists only its further arguments and options.

"""


def as_markdown() -> str:
    """Return the page."""
    from mrpipe.cli.app import GROUPS, app
    from mrpipe.cli.options import _COMMON

    group: Any = get_command(app)
    context = typer.Context(group, info_name="mrpipe")
    names = [name for name in group.list_commands(context) if not group.get_command(context, name).hidden]
    listed = [name for commands in GROUPS.values() for name in commands]
    headings = {**GROUPS, "Further stages": tuple(name for name in names if name not in listed)}
    prepare = group.get_command(context, "prepare")
    common = [item for item in prepare.params if item.name in _COMMON]
    lines = [_HEAD, _COMMON_HEAD, _table(common, context)]
    for heading, commands in headings.items():
        known = [name for name in commands if name in names]
        if known:
            lines.append(f"\n## {heading}\n")
        lines += [_command(name, group.get_command(context, name), context, set(_COMMON)) for name in known]
    return "".join(lines)


def _command(name: str, command: Any, context: Any, common: set[str]) -> str:
    own = typer.Context(command, info_name=name, parent=context)
    usage = " ".join(["mrpipe", name, *command.collect_usage_pieces(own)])
    parameters = [item for item in command.params if item.name not in common and item.name != "help"]
    text = " ".join((command.help or "").split())
    table = f"\n{_table(parameters, own)}" if parameters else ""
    return f"\n### mrpipe {name}\n\n{text}\n\n    {usage}\n{table}"


def _table(parameters: list[Any], context: Any) -> str:
    rows = ["| argument or option | meaning |\n| --- | --- |\n"]
    for item in parameters:
        record = item.get_help_record(context)
        if record is not None:
            names, text = (" ".join(part.split()).replace("|", chr(92) + "|") for part in record)
            rows.append(f"| `{names}` | {text} |\n")
    return "".join(rows)


if __name__ == "__main__":
    sys.stdout.write(as_markdown())
