"""Compiled code always belongs to the present sources."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

import mrpipe
from mrpipe.numba_cache import cache_folder, compiled_sources, key_of

PACKAGE = Path(mrpipe.__file__).resolve().parent
# the caller `late_force_step` is compiled in another module than the function `between` that it calls
_CALLER = """
import numpy as np
from mrpipe.effects.channel_skew import late_force_step
from mrpipe.dampers.plant import DISPLACEMENT, FIRST, WIRE_SIZE
wire, state = np.zeros(WIRE_SIZE), np.zeros(4 * 8 + 1)
wire[FIRST], wire[DISPLACEMENT] = 1.0, 2.0
late_force_step(wire, state, np.array([0.001]), 0.01)
print(wire[DISPLACEMENT])
"""


def _run(code: str, folder: Path, **environment: str) -> str:
    kept = {key: value for key, value in os.environ.items() if key not in {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**kept, "PYTHONDONTWRITEBYTECODE": "1", **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


@pytest.mark.property
def test_a_caller_in_another_module_sees_an_edited_function(tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(PACKAGE, copy / "mrpipe", ignore=shutil.ignore_patterns("__pycache__", "_configs"))
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert float(_run(_CALLER, copy, **cache)) == 2.0
    assert float(_run(_CALLER, copy, **cache)) == 2.0  # from the cache
    source = copy / "mrpipe/dampers/timing.py"
    text, times = source.read_text(), source.stat()
    edited = text.replace("    return first + part * (", "    return 1000.0 + part * (")
    assert edited != text
    source.write_text(edited)
    os.utime(source, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert float(_run(_CALLER, copy, **cache)) == 1000.0


@pytest.mark.property
def test_every_compiled_module_and_what_it_imports_is_in_the_key(tmp_path: Path) -> None:
    names = {path.relative_to(PACKAGE).as_posix() for path in compiled_sources(PACKAGE)}
    assert {"dampers/plant.py", "dampers/hysteresis.py", "simulation/kernel.py", "control/kernel.py"} <= names
    assert "effects/structural/joint_friction.py" in names
    assert "artifacts/types.py" in names  # imported by them
    assert not any(name.startswith(("reporting/", "cli/", "stages/")) for name in names)
    copy = tmp_path / "mrpipe"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "_configs"))
    before = key_of(copy)
    page = copy / "reporting/page.py"
    page.write_text(page.read_text() + "\n")
    assert key_of(copy) == before
    kernel = copy / "simulation/kernel.py"
    kernel.write_text(kernel.read_text() + "\n")
    assert key_of(copy) != before


@pytest.mark.property
@pytest.mark.parametrize("first", ["mrpipe", "numba", "mrpipe.simulation"])
def test_numba_uses_the_folder_whatever_is_imported_first(first: str, tmp_path: Path) -> None:
    expected = tmp_path / f"mrpipe-{key_of(PACKAGE)}"
    code = "import {first}\nimport mrpipe\nimport numba\nprint(numba.config.CACHE_DIR)".format(
        first=first.replace("mrpipe.simulation", "mrpipe.artifacts")
    )
    assert _run(code, PACKAGE.parent, NUMBA_CACHE_DIR=str(tmp_path)) == str(expected)
    # a child process inherits the variable: no folder within the folder
    assert _run(code, PACKAGE.parent, NUMBA_CACHE_DIR=str(expected)) == str(expected)


@pytest.mark.property
def test_a_home_directory_that_cannot_be_written_is_replaced_by_a_temporary_one(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.write_text("a file: no folder can be made below it, not even by an administrator")
    code = "import mrpipe, numba; print(numba.config.CACHE_DIR)"
    place = _run(code, PACKAGE.parent, HOME=str(home), TMPDIR=str(tmp_path))
    assert Path(place).parent.parent == tmp_path
    assert os.access(place, os.W_OK)


@pytest.mark.property
def test_worker_processes_use_the_same_folder(tmp_path: Path) -> None:
    code = (
        "import joblib, mrpipe, numba\n"
        "def where():\n    import mrpipe.artifacts, numba\n    return numba.config.CACHE_DIR\n"
        "print(*{numba.config.CACHE_DIR, *joblib.Parallel(2)(joblib.delayed(where)() for _ in range(2))})"
    )
    assert _run(code, PACKAGE.parent, NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path / f"mrpipe-{key_of(PACKAGE)}")


@pytest.mark.property
def test_folders_that_nobody_used_for_a_month_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, recent, foreign = (tmp_path / name for name in ("mrpipe-old", "mrpipe-recent", "other"))
    for folder in (old, recent, foreign):
        folder.mkdir()
    for folder in (old, foreign):
        os.utime(folder, (time.time() - 40 * 86400,) * 2)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    present = cache_folder()
    assert present is not None
    assert {item.name for item in tmp_path.iterdir()} == {present.name, "mrpipe-recent", "other"}


@pytest.mark.property
def test_a_users_effect_file_is_compiled_again_after_an_edit_that_keeps_size_and_time(tmp_path: Path) -> None:
    effect = tmp_path / "effect.py"
    text = (
        "import numpy as np\nfrom numba import njit\n"
        "from mrpipe.dampers.plant import FORCE, STEP_SIGNATURE\n"
        "@njit(STEP_SIGNATURE, cache=True)\n"
        "def step(wire, state, parameters, dt):\n    wire[FORCE] = 1.0\n"
        "wire = np.zeros(24)\nstep(wire, np.zeros(1), np.zeros(1), 0.1)\nEFFECT = wire[FORCE]\n"
    )
    code = (
        "from pathlib import Path\nfrom mrpipe.effects.library import effect_of_file\n"
        f"print(effect_of_file(Path({str(effect)!r})))"
    )
    effect.write_text(text)
    times = effect.stat()
    shown = [_run(code, PACKAGE.parent)]
    effect.write_text(text.replace("1.0", "2.0"))
    os.utime(effect, ns=(times.st_atime_ns, times.st_mtime_ns))
    shown.append(_run(code, PACKAGE.parent))
    assert shown == ["1.0", "2.0"]


@pytest.mark.property
def test_of_many_folders_only_the_latest_outlive_a_day(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for days in range(30):
        folder = tmp_path / f"mrpipe-{days:02d}"
        folder.mkdir()
        os.utime(folder, (time.time() - (0.1 + 0.1 * days) * 86400,) * 2)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    present = cache_folder()
    assert present is not None
    # the ten latest, all of the last day
    assert sorted(item.name for item in tmp_path.iterdir() if item != present) == [
        f"mrpipe-{days:02d}" for days in range(10)
    ]
