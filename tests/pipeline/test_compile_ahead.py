"""A second process compiles what later stages need, once."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.numba_cache import cache_folder
from mrpipe.pipeline import compile_ahead
from mrpipe.pipeline.compile_ahead import _started, compiled_ahead, modules_of

MODULE = "mrpipe.dampers.timing"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    found = cache_folder()
    assert found is not None
    return found


@pytest.mark.property
def test_modules_with_compiled_functions_are_listed_in_the_order_of_the_stages() -> None:
    frame, bench = modules_of(["mrpipe.stages.identify_frame"]), modules_of(["mrpipe.stages.identify_damper"])
    assert "mrpipe.fitting.kernel" in bench
    assert "mrpipe.pipeline.runner" not in bench
    assert "mrpipe.numba_cache" not in bench
    assert modules_of(["mrpipe.stages.identify_frame", "mrpipe.stages.identify_damper"])[: len(frame)] == frame


@pytest.mark.property
def test_what_is_compiled_once_is_in_the_cache_and_is_not_compiled_again(folder: Path) -> None:
    process = _started([MODULE])
    assert process is not None
    assert process.wait(timeout=120) == 0
    assert any(item.suffix == ".nbc" for item in folder.rglob("*timing*"))
    assert _started([MODULE]) is None
    assert list(folder.glob("compiled-*"))


@pytest.mark.property
def test_another_copy_of_the_sources_is_compiled_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = compile_ahead._mark([MODULE])
    monkeypatch.setattr(compile_ahead, "__file__", str(folder / "copy" / "mrpipe" / "pipeline" / "compile_ahead.py"))
    assert compile_ahead._mark([MODULE]) != here


@pytest.mark.property
def test_the_compiler_ends_with_the_run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started = []
    real = compile_ahead._started
    monkeypatch.setattr(compile_ahead, "_started", lambda modules: started.append(real(modules)) or started[0])
    with compiled_ahead(["mrpipe.stages.identify_damper"], 2):
        assert started[0] is not None
        assert started[0].poll() is None
    assert started[0].poll() is not None
    assert not list(folder.glob("compiled-*"))


@pytest.mark.property
def test_one_process_only_means_no_second_one(folder: Path) -> None:
    with compiled_ahead(["mrpipe.stages.identify_damper"], 1):
        pass
    assert not list(folder.glob("compiled-*"))
