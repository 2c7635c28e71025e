"""A user's own Python file: loaded again after an edit, and every fault in one line."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from mrpipe.dampers.user_file import module_of_file
from mrpipe.errors import UserError

pytestmark = pytest.mark.property


def _load(path: Path) -> object:
    return module_of_file(path, "close_loop.effect_files", "name a Python file")


def test_an_edited_file_is_a_new_module_and_the_same_file_is_not(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text("VALUE = 1\n", encoding="utf-8")
    saved = path.stat()
    first = _load(path)
    assert first.VALUE == 1  # type: ignore[attr-defined]
    assert _load(path).__name__ == first.__name__  # type: ignore[attr-defined]
    path.write_text("VALUE = 2\n", encoding="utf-8")
    # the worst case: the same size and the same time of the last change
    os.utime(path, ns=(saved.st_atime_ns, saved.st_mtime_ns))
    second = _load(path)
    assert second.VALUE == 2  # type: ignore[attr-defined]
    assert second.__name__ != first.__name__  # type: ignore[attr-defined]


def test_a_file_that_fails_leaves_no_module_behind(tmp_path: Path) -> None:
    path = tmp_path / "broken.py"
    path.write_text("raise ValueError('line one\\nline two')\n", encoding="utf-8")
    before = set(sys.modules)
    with pytest.raises(UserError, match="cannot be run: line one") as found:
        _load(path)
    assert "line two" not in str(found.value)
    assert found.value.where == "close_loop.effect_files, line 1"
    path.write_text("x = 1\n\ndef f(:\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"close_loop\.effect_files, line 3: cannot be run: "):
        _load(path)
    path.write_text("import math\n\nmath.sqrt(\n    -1.0\n)\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"close_loop\.effect_files, line 3: cannot be run: "):
        _load(path)
    assert not {name for name in set(sys.modules) - before if "broken" in name}


@pytest.mark.parametrize(("name", "problem"), [("none.py", "no such file"), ("text.md", "is not a Python file")])
def test_what_is_no_python_file_is_refused(name: str, problem: str, tmp_path: Path) -> None:
    (tmp_path / "text.md").write_text("# a text", encoding="utf-8")
    with pytest.raises(UserError, match=problem):
        _load(tmp_path / name)
