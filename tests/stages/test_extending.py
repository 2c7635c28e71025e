"""A base form and an effect of a structure are one file each: found by name, nothing else has to be edited."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrpipe.dampers.forms
import mrpipe.effects.structural
from tests.tracing.structure.rig import MASSES, frame_campaign

PACKAGE = Path(mrpipe.dampers.forms.__file__).parents[2]
PROGRAM = """
import sys
import mrpipe.dampers.forms, mrpipe.effects.structural
mrpipe.dampers.forms.__path__.append(sys.argv[1])
mrpipe.effects.structural.__path__.append(sys.argv[2])
from mrpipe.cli import run
sys.exit(run(sys.argv[3:]))
"""


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Return folders with a new base form and a new structural effect: known ones under other names."""
    forms, effects = tmp_path / "forms", tmp_path / "effects"
    for folder, source, old, new in (
        (forms, PACKAGE / "dampers" / "forms" / "dahl.py", "dahl", "slip-friction"),
        (effects, PACKAGE / "effects" / "structural" / "cubic_stiffness.py", "cubic-stiffness", "stiffening-joint"),
    ):
        folder.mkdir()
        text = source.read_text(encoding="utf-8").replace(f'name="{old}"', f'name="{new}"')
        assert new in text
        (folder / f"{new.replace('-', '_')}.py").write_text(text, encoding="utf-8")
    return forms, effects


def run(folders: Sequence[Path], *arguments: str) -> dict[str, Any]:
    """Run the program with further folders and return what it prints as JSON."""
    command = [sys.executable, "-c", PROGRAM, *map(str, folders), *arguments, "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def bench(folder: Path) -> Path:
    """Write a bench campaign of friction with a yield displacement, at two levels of current."""
    folder.mkdir()
    time = np.arange(0.0, 4.0, 0.004)
    tests = []
    for name, role, current, rate in (
        ("a", "training", 0.5, 6.0),
        ("b", "training", 1.5, 9.0),
        ("c", "validation", 1.5, 7.0),
    ):
        x, v = 0.01 * np.sin(rate * time), 0.01 * rate * np.cos(rate * time)
        z = np.zeros_like(x)
        for k in range(1, len(x)):
            step = x[k] - x[k - 1]
            z[k] = z[k - 1] + (step - abs(step) * z[k - 1]) / 4e-4
        force = (20.0 + 60.0 * current) * z + 100.0 * v
        rows = np.column_stack([time, x, np.full_like(x, current), force])
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header="t,x,i,F", comments="", fmt="%.9g")
        tests.append(f"  - {{name: {name}, file: {name}.csv, role: {role}}}")
    (folder / "campaign.yaml").write_text(
        "campaign: own\nrig: damper-bench\nsampling_rate_hz: 250\nchannels:\n  time: {column: t, unit: s}\n"
        "  displacement: {column: x, unit: m}\n  drive: {column: i, unit: A}\n  force: {column: F, unit: N}\ntests:\n"
        + "\n".join(tests) + "\n",
        encoding="utf-8",
    )  # fmt: skip
    return folder


def frame(folder: Path) -> Path:
    """Write the tests' own frame with a stiffening storey as a campaign."""
    folder.mkdir()
    campaign = frame_campaign("cubic-stiffness")
    lines, tests = [], []
    for item in campaign.recordings:
        names = sorted(item.channels)
        np.savetxt(
            folder / f"{item.name}.csv", np.column_stack([item.channels[name] for name in names]), delimiter=",",
            header=",".join(names), comments="", fmt="%.9g",
        )  # fmt: skip
        tests.append(f"  - {{name: {item.name}, file: {item.name}.csv, role: {item.role}, kind: {item.kind}}}")
        lines = [f"  {name}: {{column: {name}, unit: {'m' if 'displacement' in name else 'm/s^2'}}}" for name in names]
    masses = ", ".join(f"{mass:g}" for mass in MASSES)
    (folder / "campaign.yaml").write_text(
        f"campaign: own\nrig: shear-frame\nsampling_rate_hz: {campaign.recordings[0].sampling_rate_hz:g}\n"
        f"frame: {{floor_masses_kg: [{masses}]}}\nchannels:\n" + "\n".join(lines) + "\ntests:\n" + "\n".join(tests)
        + "\n",
        encoding="utf-8",
    )  # fmt: skip
    return folder


@pytest.mark.planted
def test_a_new_base_form_is_fitted(folders: tuple[Path, Path], tmp_path: Path) -> None:
    found = run(
        folders, "identify-damper", "--campaign", str(bench(tmp_path / "bench")), "--run", str(tmp_path / "run"),
        "--set", "identify_damper.form=slip-friction", "--set", "identify_damper.compare=[slip-friction, bouc-wen]",
    )  # fmt: skip
    assert found["form"] == "slip-friction"
    row = next(item for item in found["comparison"] if item["form"] == "slip-friction")
    assert row["validation_nrmse"] < 0.05


@pytest.mark.planted
def test_a_new_effect_of_a_structure_is_named(folders: tuple[Path, Path], tmp_path: Path) -> None:
    found = run(
        folders, "close-loop", "--campaign", str(frame(tmp_path / "frame")), "--run", str(tmp_path / "run"),
        "--set", "close_loop.candidates=[stiffening-joint]",
    )  # fmt: skip
    assert [item["name"] for item in found["effects"]] == ["stiffening-joint"]
