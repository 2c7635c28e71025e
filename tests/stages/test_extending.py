"""A base form, an effect, an effect of a structure and a law are one file each: nothing else has to be edited.

Each test puts one new file into a temporary folder and runs the program on it. `test_registry.py` does it with a stage.
"""

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
PACKAGES = ("mrpipe.dampers.forms", "mrpipe.effects.structural", "mrpipe.effects", "mrpipe.control.laws")
PROGRAM = f"""
import importlib, sys
for name, folder in zip({PACKAGES}, sys.argv[1:]):
    importlib.import_module(name).__path__.append(folder)
from mrpipe.cli import run
sys.exit(run(sys.argv[{len(PACKAGES) + 1}:]))
"""


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, ...]:
    """Return a folder for each of PACKAGES with one new file: a known form, effect or law under another name."""
    found = []
    for package, old, new in zip(
        PACKAGES,
        ("dahl", "cubic-stiffness", "accumulator", "vd"),
        ("slip-friction", "stiffening-joint", "gas-cushion", "linear-drag"),
        strict=True,
    ):
        source = PACKAGE.parent.joinpath(*package.split("."), f"{old.replace('-', '_')}.py")
        text = source.read_text(encoding="utf-8").replace(f'name="{old}"', f'name="{new}"')
        assert new in text
        folder = tmp_path / package
        folder.mkdir()
        (folder / f"{new.replace('-', '_')}.py").write_text(text, encoding="utf-8")
        found.append(folder)
    return tuple(found)


def run(folders: Sequence[Path], *arguments: str) -> dict[str, Any]:
    """Run the program with further folders and return what it prints as JSON."""
    command = [sys.executable, "-c", PROGRAM, *map(str, folders), *arguments, "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def bench(folder: Path, stiffness_n_m: float = 0.0) -> Path:
    """Write a bench campaign of friction with a yield displacement and a spring, at two levels of current."""
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
        force = (20.0 + 60.0 * current) * z + 100.0 * v + stiffness_n_m * x
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
def test_a_new_base_form_is_fitted(folders: tuple[Path, ...], tmp_path: Path) -> None:
    found = run(
        folders, "identify-damper", "--campaign", str(bench(tmp_path / "bench")), "--run", str(tmp_path / "run"),
        "--set", "identify_damper.form=slip-friction", "--set", "identify_damper.compare=[slip-friction, bouc-wen]",
    )  # fmt: skip
    assert found["form"] == "slip-friction"
    row = next(item for item in found["comparison"] if item["form"] == "slip-friction")
    assert row["validation_nrmse"] < 0.05


@pytest.mark.planted
def test_a_new_effect_of_a_structure_is_named(folders: tuple[Path, ...], tmp_path: Path) -> None:
    found = run(
        folders, "close-loop", "--campaign", str(frame(tmp_path / "frame")), "--run", str(tmp_path / "run"),
        "--set", "close_loop.candidates=[stiffening-joint]",
    )  # fmt: skip
    assert [item["name"] for item in found["effects"]] == ["stiffening-joint"]


@pytest.mark.planted
def test_a_new_effect_of_a_damper_is_named(folders: tuple[Path, ...], tmp_path: Path) -> None:
    campaign = bench(tmp_path / "bench", stiffness_n_m=4000.0)
    found = run(
        folders, "close-loop", "--campaign", str(campaign), "--run", str(tmp_path / "run"), "--jobs", "1",
        "--set", "close_loop.candidates=[gas-cushion]", "--set", "close_loop.base_forms=[dahl]",
        "--set", "close_loop.model=dahl",
    )  # fmt: skip
    assert [item["name"] for item in found["effects"]] == ["gas-cushion"]


@pytest.mark.planted
def test_a_new_law_is_calibrated_and_simulated(folders: tuple[Path, ...], tmp_path: Path) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(
        "name: own\nstages: [identify-frame, calibrate, simulate-dampers]\n"
        "campaigns: {bench: null, frame: null, closed_loop: null}\nstructure:\n  storeys:\n"
        "    - {mass_kg: 100.0, stiffness_n_m: 8.0e3, repeat: 2}\n  damping_ratio: [0.01]\n"
        "  dampers:\n    - {name: base, between: [1, ground], law: linear-drag}\n"
        "calibrate: {damper: set-c, expected_amplitude_m: 0.01}\n"
        "simulate:\n  plant_rate_hz: 1000\n  controller: {inverse: model}\n"
        "  excitation: {kind: harmonic, cycles: 8, settling_cycles: 4, decay_s: 3.0}\n",
        encoding="utf-8",
    )
    place = ["--config", str(config), "--run", str(tmp_path / "run")]
    found = run(folders, "simulate", *place)
    assert found["rms_x_top_m"] > 0.0
    (damper,) = found["dampers"]
    assert damper["law"] == "linear-drag"
