"""Docstrings tell the truth: no documented argument or attribute that does not exist, none left out of a list.

A docstring need not list arguments. One that has a section `Parameters` lists every argument, and a class docstring
with a section `Attributes` lists every public field.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.property

PACKAGE = Path(__file__).resolve().parents[1] / "mrpipe"
MODULES = sorted(PACKAGE.rglob("*.py"))

NOT_IN_THE_REPOSITORY = re.compile(
    r"contract section|section \d+ of the contract|the contract lists|shared notes|tracing notes|issue \d",
    re.IGNORECASE,
)
"""Words that cite a document which a reader of the repository does not have."""


def _names(docstring: str, section: str) -> list[str] | None:
    """Return the names that a section lists, or None where there is no such section."""
    lines = docstring.expandtabs().splitlines()
    for index in range(len(lines) - 1):
        if lines[index].strip() == section and set(lines[index + 1].strip()) == {"-"}:
            indent = len(lines[index]) - len(lines[index].lstrip())
            names: list[str] = []
            for at in range(index + 2, len(lines)):
                line = lines[at]
                following = lines[at + 1].strip() if at + 1 < len(lines) else ""
                if line.strip() and set(following) == {"-"}:
                    break
                entry = re.fullmatch(r"([*\w]+(?:, [*\w]+)*)(?: : .*)?", line.strip())
                if entry and len(line) - len(line.lstrip()) == indent:
                    names += [name.lstrip("*") for name in entry[1].split(", ")]
            return names
    return None


def _arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    found = [item.arg for item in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
    found += [item.arg for item in (node.args.vararg, node.args.kwarg) if item is not None]
    return [name for name in found if name not in ("self", "cls")]


def _fields(node: ast.ClassDef) -> tuple[set[str], set[str]]:
    """Return the declared public fields, and every name that may be documented as an attribute."""
    declared = {
        item.target.id
        for item in node.body
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and not item.target.id.startswith("_")
        and not ast.unparse(item.annotation).startswith("ClassVar")
    }
    more = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
    more |= {
        target.attr
        for item in ast.walk(node)
        if isinstance(item, ast.Assign | ast.AnnAssign)
        for target in (item.targets if isinstance(item, ast.Assign) else [item.target])
        if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name) and target.value.id == "self"
    }
    more |= {
        target.id
        for item in node.body
        if isinstance(item, ast.Assign)
        for target in item.targets
        if isinstance(target, ast.Name)
    }
    return declared, declared | more


def _findings(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    classes = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        docstring = ast.get_docstring(node) or ""
        place = f"{path.relative_to(PACKAGE)}:{node.lineno} {node.name}"
        if isinstance(node, ast.ClassDef):
            listed = _names(docstring, "Attributes")
            if listed is None:
                continue
            declared, known = _fields(node)
            bases = [base.id for base in node.bases if isinstance(base, ast.Name)]
            inherited = {name for base in bases if base in classes for name in _fields(classes[base])[1]}
            foreign = [base for base in bases if base not in classes]
            required, allowed = declared, known | inherited
            phantoms = [] if foreign and foreign != ["Protocol"] else [name for name in listed if name not in allowed]
        else:
            listed = _names(docstring, "Parameters")
            if listed is None:
                continue
            required = set(_arguments(node))
            phantoms = [name for name in listed if name not in required]
        left_out = sorted(required - set(listed))
        if phantoms:
            yield f"{place}: documents {', '.join(phantoms)}, which does not exist"
        if left_out:
            yield f"{place}: leaves out {', '.join(left_out)}"


def test_docstrings_list_what_exists_and_leave_nothing_out() -> None:
    assert [line for path in MODULES for line in _findings(path)] == []


def test_no_docstring_or_comment_cites_a_document_outside_the_repository() -> None:
    cited = [
        f"{path.relative_to(PACKAGE)}:{number}: {line.strip()}"
        for path in MODULES
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if NOT_IN_THE_REPOSITORY.search(line)
    ]
    assert cited == []


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ('def f(a, b):\n    """Do.\n\n    Parameters\n    ----------\n    a, c\n        One.\n    """\n', ["c", "b"]),
        (
            'class A:\n    """Do.\n\n    Attributes\n    ----------\n    x\n        One.\n    """\n\n    y: int\n',
            ["x", "y"],
        ),
    ],
)
def test_the_test_itself_finds_both_kinds(source: str, expected: list[str], tmp_path: Path) -> None:
    path = PACKAGE / "x.py"
    tree_source = tmp_path / "x.py"
    tree_source.write_text(source, encoding="utf-8")
    found = " ".join(_in_text(source, path))
    assert all(re.search(rf"(documents|leaves out) {name}", found) for name in expected)


def _in_text(source: str, path: Path) -> list[str]:
    class _Text(type(path)):  # type: ignore[misc]
        def read_text(self, *_: object, **__: object) -> str:
            return source

    return list(_findings(_Text(path)))
