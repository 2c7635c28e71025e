"""Every module has a test: one that imports it, one of its name, or one that runs all modules of its folder."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

pytestmark = pytest.mark.property

TESTS = Path(__file__).resolve().parent
PACKAGE = TESTS.parent / "mrpipe"

THROUGH = {
    "api": "api/test_api.py",
    "campaigns/plausibility": "campaigns/plausibility",
    "campaigns/proposal": "campaigns/proposal",
    "campaigns/readers": "campaigns/test_formats.py",
    "cli": "cli",
    "config/sections": "config/test_options.py",
    "control/laws": "control/laws",
    "dampers/forms": "dampers/test_forms.py",
    "effects": "effects/test_effects.py",
    "exports/formats": "exports/test_models.py",
    "exports/translation": "exports/test_models.py",
    "laboratory": "laboratory",
    "reporting": "docs/test_commands.py",
    "stages": "docs/test_commands.py",
    "tracing/rules": "tracing/test_rules.py",
}
"""Folder of the package whose modules are found by name or run by commands -> tests that run all of them."""


def _module(path: Path) -> str:
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


def _imports(path: Path) -> set[str]:
    """Return the dotted names that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def _tested() -> set[str]:
    """Return the modules that tests import, also through the face of a package."""
    faces = {_module(path): _imports(path) for path in PACKAGE.rglob("__init__.py")}
    found = set()
    for path in TESTS.rglob("*.py"):
        for name in _imports(path):
            found |= {name, name.rpartition(".")[0]}
            package, _, item = name.rpartition(".")
            found |= {target.rpartition(".")[0] for target in faces.get(package, ()) if target.endswith(f".{item}")}
    return found


def _mirrored(path: Path) -> bool:
    folder = path.relative_to(PACKAGE).parent
    through = any(folder.is_relative_to(known) for known in THROUGH)
    return through or (TESTS / folder / f"test_{path.stem}.py").is_file()


def test_every_module_is_tested() -> None:
    tested = _tested()
    modules = [path for path in PACKAGE.rglob("*.py") if not path.name.startswith("__")]
    assert len(modules) > 400
    missing = {_module(path) for path in modules if _module(path) not in tested and not _mirrored(path)}
    assert sorted(missing) == []


def test_the_tests_of_folders_exist() -> None:
    assert [place for place in THROUGH.values() if not (TESTS / place).exists()] == []
