"""The worked example of the README: its files, its commands, and its lines of Python."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

import mrpipe.api
from mrpipe.cli import run
from tests.docs.shown import ROOT, shown

README = (ROOT / "README.md").read_text(encoding="utf-8")
QUICK = ["--until", "prepare"]
"""The later stages of a project are run on a small configuration by `test_commands.py`."""


def _campaign() -> str:
    found = re.search(r"^```yaml\n(campaign:.*?)^```", README, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def _record(path: Path) -> None:
    """Write a test of a damper with friction and viscous force at the level of current that its name says."""
    found = re.search(r"(\d+)A", path.stem)
    assert found is not None
    current = float(found[1])
    rng = np.random.default_rng(int(current))
    time = np.arange(0.0, 10.0, 0.002)
    phase = 2.0 * np.pi * time
    displacement, velocity = 10.0 * np.sin(phase), 0.02 * np.pi * np.cos(phase)
    force = (50.0 + 150.0 * current) * np.tanh(velocity / 0.004) + 900.0 * velocity + rng.normal(0.0, 1.0, len(time))
    rows = np.column_stack([time, displacement, np.full_like(time, current), force])
    np.savetxt(path, rows, delimiter=",", header="t,x,i,F", comments="", fmt="%.7g")


@pytest.mark.golden
def test_worked_example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    block = [call.words for call in shown(ROOT / "README.md") if "my-rig" in " ".join(call.words)]
    assert [words[0] for words in block] == ["init", "show", "check", "run", "status"]
    monkeypatch.chdir(tmp_path)
    assert run(list(block[0])) == 0
    monkeypatch.chdir(tmp_path / "my-rig")
    data = tmp_path / "my-rig" / "data" / "my-rig"
    (data / "campaign.yaml").write_text(_campaign(), encoding="utf-8")
    for test in yaml.safe_load(_campaign())["tests"]:
        _record(data / test["file"])
    for words in block[1:]:
        capsys.readouterr()
        assert run([*words, *(QUICK if words[0] == "run" else [])]) == 0, (words, capsys.readouterr().err)
    assert "prepare              up to date" in capsys.readouterr().out


@pytest.mark.property
def test_lines_of_python_use_functions_and_arguments_that_exist() -> None:
    (code,) = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
    calls = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.Call)]
    named = {node.func.attr: node for node in calls if isinstance(node.func, ast.Attribute)}
    functions = {name for name, node in named.items() if ast.unparse(node.func) == f"mrpipe.{name}"}
    assert {"load_campaign", "prepare", "trace", "identify_frame", "simulate", "design"} == functions
    assert functions <= set(mrpipe.api.__all__)
    assert len([line for line in code.splitlines() if line.strip()]) <= 15
