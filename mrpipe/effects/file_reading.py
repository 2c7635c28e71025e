"""Reading of an effect file of a user without running it.

A configuration may come from somebody else, so `mrpipe check` must not run the Python files that it names. Commands
that trace effects (`run`, `close-loop`) and `check-effect` run them.
"""

from __future__ import annotations

import ast
from pathlib import Path

from mrpipe.dampers.user_file import check_is_file
from mrpipe.errors import UserError

REMEDY = "name a Python file that defines EFFECT"
"""Remedy for a file that defines no effect."""


def name_in_file(path: Path, setting: str = "close_loop.effect_files") -> str:
    """Return the name of the effect that a file defines, empty if the name is computed.

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
    if isinstance(value, ast.Call):
        for keyword in value.keywords:
            if keyword.arg == "name" and isinstance(keyword.value, ast.Constant):
                return str(keyword.value.value)
        if value.args and isinstance(value.args[0], ast.Constant):
            return str(value.args[0].value)
    return ""


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
