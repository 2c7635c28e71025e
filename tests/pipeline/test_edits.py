"""After an edit the next `status` says what changed, and the next run uses it: the program in a folder of its own."""

from __future__ import annotations

import json
import os
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrpipe.stages
from mrpipe.numba_cache import _module_of, compiled_sources
from mrpipe.pipeline.code_version import code_version

PACKAGE = Path(mrpipe.__file__).resolve().parent


@pytest.mark.property
def test_every_compiled_function_is_in_the_code_version_of_a_stage() -> None:
    stages = [item.name for item in pkgutil.iter_modules(mrpipe.stages.__path__) if item.name != "registry"]
    known = {module for stage in stages for module in code_version(f"mrpipe.stages.{stage}")}
    compiled = {_module_of(path, PACKAGE) for path in compiled_sources(PACKAGE)}
    assert len(compiled) > 50
    assert sorted(compiled - known) == []


def _program(place: Path, *arguments: str) -> dict[str, Any]:
    """Run the program of a folder there and return what it prints as JSON."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(place / "cache"), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "mrpipe", *arguments, "--json"]
    done = subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def _reasons(place: Path, stage: str) -> str:
    return "; ".join(_program(place, "status", "run")["stages"][stage]["reasons"])


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Return a folder with a copy of the program."""
    shutil.copytree(PACKAGE, tmp_path / "mrpipe", ignore=shutil.ignore_patterns("__pycache__"))
    if not (PACKAGE / "_configs").is_dir():
        shutil.copytree(PACKAGE.parent / "configs", tmp_path / "configs")
    return tmp_path


@pytest.mark.golden
def test_an_edited_compiled_function(place: Path) -> None:
    data = place / "data"
    data.mkdir()
    time = np.arange(0.0, 4.0, 0.002)
    x, a = 0.01 * np.sin(6.0 * time), -0.36 * np.sin(6.0 * time)
    rows = np.column_stack([time, x, a, np.ones_like(time), 100.0 * np.cos(6.0 * time)])
    tests = []
    for name, role in (("a", "training"), ("b", "validation")):
        np.savetxt(data / f"{name}.csv", rows, delimiter=",", header="t,x,a,i,F", comments="", fmt="%.9g")
        tests.append(f"  - {{name: {name}, file: {name}.csv, role: {role}}}\n")
    (data / "campaign.yaml").write_text(
        "campaign: own\nrig: damper-bench\nchannels:\n  time: {column: t, unit: s}\n"
        "  displacement: {column: x, unit: m}\n  acceleration: {column: a, unit: m/s^2}\n"
        f"  drive: {{column: i, unit: A}}\n  force: {{column: F, unit: N}}\ntests:\n{''.join(tests)}",
        encoding="utf-8",
    )
    (place / "own.yaml").write_text(
        "name: own\nstages: [prepare]\ncampaigns: {bench: data, frame: null, closed_loop: null}\n"
        "prepare: {differentiation: kalman}\n",
        encoding="utf-8",
    )
    prepare = ("prepare", "--config", "own.yaml", "--run", "run", "--quiet")
    before = _program(place, *prepare)["tests"][0]["velocity_peak_m_s"]
    assert _reasons(place, "prepare") == ""
    source = place / "mrpipe" / "signals" / "kalman.py"
    text = source.read_text(encoding="utf-8")
    # twice the measured displacement and acceleration in the recursion
    edited = text.replace("+ previous[", "+ 2.0 * previous[").replace("+ present[", "+ 2.0 * present[")
    assert edited != text
    source.write_text(edited, encoding="utf-8")
    assert "mrpipe.signals.kalman" in _reasons(place, "prepare")
    after = _program(place, *prepare)["tests"][0]["velocity_peak_m_s"]
    assert after == pytest.approx(2.0 * before, rel=0.05)
    assert _reasons(place, "prepare") == ""


@pytest.mark.golden
def test_an_edited_file_that_a_setting_names(place: Path) -> None:
    for name, factor in (("mass", 100.0), ("stiffness", 8000.0)):
        matrix = factor * (np.eye(2) if name == "mass" else np.array([[2.0, -1.0], [-1.0, 1.0]]))
        np.savetxt(place / f"{name}.csv", matrix, delimiter=",")
    (place / "own.yaml").write_text(
        "name: own\nstages: [identify-frame]\ncampaigns: {bench: null, frame: null, closed_loop: null}\n"
        "structure:\n  mass: {file: mass.csv, unit: kg}\n  stiffness: {file: stiffness.csv, unit: N/m}\n"
        "  damping_ratio: [0.01]\n",
        encoding="utf-8",
    )
    identify = ("identify-frame", "--config", "own.yaml", "--run", "run", "--quiet")
    before = _program(place, *identify)["frequencies_hz"]
    assert _reasons(place, "identify-frame") == ""
    np.savetxt(place / "mass.csv", 400.0 * np.eye(2), delimiter=",")
    assert "mass" in _reasons(place, "identify-frame")
    after = _program(place, *identify)["frequencies_hz"]
    assert after == pytest.approx([0.5 * value for value in before])
