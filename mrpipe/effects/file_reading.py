"""Reading of an effect file of a user without running it.

A configuration may come from somebody else, so `mrpipe check` must not run the Python files that it names. Commands
that trace effects (`run`, `close-loop`) and `check-effect` run them.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

from mrpipe.dampers.user_file import check_is_file
from mrpipe.errors import UserError

REMEDY = "name a Python file that defines EFFECT"
"""Remedy for a file that defines no effect."""


@dataclass(frozen=True)
class FoundEffect:
    """An effect as the text of its file defines it.

    Attributes
    ----------
    name
        Its name; empty if the name is computed.
    kind
        Class of the effect: `Effect` for one on a damper, `StructuralEffect` for one of a structure; empty if the text
        does not say.
    """

    name: str = ""
    kind: str = ""


def effect_in_file(path: Path, setting: str = "close_loop.effect_files") -> FoundEffect:
    """Return name and class of the effect that a file defines.

    Parameters
    ----------
    path
        Python file.
    setting
        Setting that names the file, for messages.

    Raises
    ------
    UserError
        If the file is missing, is not Python, or assigns no EFFECT.
    """
    check_is_file(path, setting, REMEDY)
    try:
        tree = ast.parse(path.read_bytes(), filename=str(path))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, "lineno", None)
        where = f"{setting}, line {line}" if line else setting
        raise UserError(path, where, f"is not Python ({getattr(error, 'msg', error)})", "correct the file") from error
    value = next((item for item in map(_effect, tree.body) if item is not None), None)
    if value is None:
        raise UserError(path, "EFFECT", "is missing", "define EFFECT = Effect(...) as mrpipe/effects/*.py do")
    return FoundEffect(_name(value), _kind(value.func)) if isinstance(value, ast.Call) else FoundEffect()


def _name(call: ast.Call) -> str:
    """Return the name that a call gives to an effect, empty if it is computed."""
    for keyword in call.keywords:
        if keyword.arg == "name" and isinstance(keyword.value, ast.Constant):
            return str(keyword.value.value)
    return str(call.args[0].value) if call.args and isinstance(call.args[0], ast.Constant) else ""


def _kind(function: ast.expr) -> str:
    """Return the name of a class as written, with or without its module: `Effect` for `contract.Effect`."""
    return getattr(function, "attr", "") or getattr(function, "id", "")


def _effect(statement: ast.stmt) -> ast.expr | None:
    """Return the expression that a statement assigns to EFFECT; None for other statements."""
    targets: list[ast.expr] = []
    if isinstance(statement, ast.Assign):
        targets = statement.targets
    elif isinstance(statement, ast.AnnAssign):
        targets = [statement.target]
    else:
        return None
    named = any(isinstance(target, ast.Name) and target.id == "EFFECT" for target in targets)
    return statement.value if named else None
