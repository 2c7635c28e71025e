"""The search for imports in the text of a module finds what Python imports."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import mrpipe
from mrpipe.source_scan import imported_modules

pytestmark = pytest.mark.property

PACKAGE = Path(mrpipe.__file__).parent


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (b"import mrpipe.units\n", {"mrpipe.units"}),
        (b"from mrpipe.dampers import plant\n", {"mrpipe.dampers", "mrpipe.dampers.plant"}),
        (b"def f():\n    from mrpipe.errors import UserError\n", {"mrpipe.errors", "mrpipe.errors.UserError"}),
        (b"from . import form\n", {"mrpipe.dampers", "mrpipe.dampers.form"}),
        (b"from ..effects import (  # why\n    heating,\n)\n", {"mrpipe.effects", "mrpipe.effects.heating"}),
        (b"import numpy\nx = 'import mrpipe'\n", set()),
    ],
)
def test_forms_of_imports(source: bytes, expected: set[str]) -> None:
    assert set(imported_modules(source, "mrpipe.dampers.model", is_package=False)) == expected


def test_no_import_of_the_package_is_missed() -> None:
    for path in PACKAGE.rglob("*.py"):
        text = path.read_bytes()
        name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
        found = set(imported_modules(text, name, path.name == "__init__.py"))
        nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom) and node.level == 0]
        needed = {node.module for node in nodes if node.module and node.module.split(".")[0] == "mrpipe"}
        assert needed <= found, path
