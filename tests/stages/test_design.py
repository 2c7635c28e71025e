"""From a design to a simulation and to C, with a structure and a damper that need no measurement."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from mrpipe.artifacts import Artifact
from mrpipe.cli import run
from mrpipe.config.loader import load_config
from mrpipe.stages.registry import stages_for
from mrpipe.structures import frame_from_parameter_set, read_frame
from tests.coarse_curves import take_coarse_curves

SMALL = {
    "campaigns": {"bench": None, "frame": None, "closed_loop": None},
    "structure": {"frame": "thesis"},
    "calibrate": {
        "damper": "set-c",
        "expected_amplitude_m": 0.0093,
        "fdns": {"alpha_n_m": 1000.0},
        "neural": {"starts": 1, "iterations": 3, "amplitudes": 2, "frequencies": 2},
    },
    "simulate": {
        "damper": "set-c",
        "plant_rate_hz": 1000.0,
        "excitation": {"base_amplitude_m_s2": 0.79, "cycles": 12, "settling_cycles": 6, "decay_s": 1.0},
        "controller": {"inverse": "model", "residual_force_n": 18.0},
    },
    "design": {
        "laws": ["fdns"],
        "amplitude_factors": [1.0],
        "band_rad_s": [8.0, 10.5],
        "grid": 3,
        "evaluations": 3,
        "draws": 0,
    },
}


@pytest.mark.property
def test_the_gains_of_a_design_are_simulated_and_exported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    take_coarse_curves(monkeypatch)
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    where = ["--config", str(path), "--run", str(tmp_path / "run")]

    def result_of(*command: str) -> dict[str, Any]:
        status = run([*command, *where, "--jobs", "1", "--json", "--quiet"])
        shown = capsys.readouterr()
        assert status == 0, shown.err
        return json.loads(shown.out)  # type: ignore[no-any-return]

    calibrated = result_of("simulate", "--law", "fdns")
    document = result_of("design", "--damper", "set-c")
    assert document["drive_unit"] == "A"  # of the keys rms_drive
    designed = document["laws"]["fdns"]
    gains = designed["gains"]
    assert gains["alpha_n_m"] != pytest.approx(designed["calibrated"]["gains"]["alpha_n_m"], rel=1e-3)
    # the largest response over frequency is no smaller than that at any one frequency
    simulated = result_of("simulate", "--law", "fdns", "--gains", "design")
    assert simulated["rms_x_top_m"] != pytest.approx(calibrated["rms_x_top_m"], rel=1e-6)
    assert simulated["rms_x_top_m"] < 1.02 * designed["peak_rms_x_top_m"]
    folder = Path(result_of("export", "controller", "--law", "fdns", "--gains", "design")["folder"])
    exported = json.loads((folder / "controller.json").read_text(encoding="utf-8"))
    assert exported["gains"]["alpha_n_m"] == pytest.approx(gains["alpha_n_m"], rel=1e-12)
    assert run(["export", "--law", "vdns", "--gains", "design", *where, "--quiet"]) == 2
    assert "the design has no gains of law vdns" in capsys.readouterr().err


@pytest.mark.property
def test_a_parameter_set_gives_the_structure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    assert run(["identify-frame", "--config", str(path), "--run", str(tmp_path / "run"), "--quiet"]) == 0
    stored, known = read_frame(Artifact(tmp_path / "run" / "frame.h5")), frame_from_parameter_set("thesis")
    for name in ("mass", "damping", "stiffness"):
        np.testing.assert_allclose(getattr(stored, name), getattr(known, name), rtol=1e-12)
    twice = {**SMALL, "structure": {"frame": "thesis", "storeys": [{"mass_kg": 1.0, "stiffness_n_m": 1.0}]}}
    path.write_text(yaml.safe_dump(twice), encoding="utf-8")
    assert run(["identify-frame", "--config", str(path), "--run", str(tmp_path / "run"), "--quiet"]) == 2
    assert "2 times: frame, storeys" in capsys.readouterr().err


@pytest.mark.property
@pytest.mark.parametrize(
    ("damper", "inverse", "inputs"),
    [
        ("set-c", "model", set()),
        ("set-c", "network", {"train-inverse"}),
        ("identified", "model", {"identify-damper"}),
        ("traced", "network", {"identify-damper", "close-loop", "train-inverse"}),
    ],
)
def test_the_loop_reads_only_what_its_damper_and_its_inverse_need(damper: str, inverse: str, inputs: set[str]) -> None:
    overrides = (f"simulate.damper={damper}", f"simulate.controller.inverse={inverse}")
    settings = load_config(Path("thesis"), overrides).config
    stages = stages_for(settings)
    for name in ("design", "simulate-vd", "resonance-vd", "export-controller"):
        found = set(stages[name].for_configuration(settings).inputs)
        assert found == {"identify-frame", "calibrate", *inputs}, name
