"""`calibrate` repeats what puts the identified structure in doubt."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from mrpipe.artifacts import Artifact
from mrpipe.cli import run
from mrpipe.modal import storage
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTests
from tests.modal.rig import Rig, random_frame, sweep_test, write

pytestmark = pytest.mark.planted

FRAME = random_frame(np.random.default_rng(3), 3)
CALIBRATE = {"damper": "set-c", "expected_amplitude_m": 0.01}


def test_calibrate_warns_of_a_wrong_mass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    test = sweep_test(FRAME, np.random.default_rng(1), Rig(noise=0.01, rate=100.0, sweep_s=80.0))
    write(FRAME, [test], tmp_path / "frame")
    file = tmp_path / "frame" / "campaign.yaml"
    declared = yaml.safe_load(file.read_text(encoding="utf-8"))
    declared["frame"]["floor_masses_kg"] = (np.diag(FRAME.mass) * np.array([1.0, 1.4, 1.0])).tolist()
    file.write_text(yaml.safe_dump(declared), encoding="utf-8")
    path = tmp_path / "run.yaml"
    campaigns = {"bench": None, "frame": str(tmp_path / "frame"), "closed_loop": None}
    path.write_text(yaml.safe_dump({"campaigns": campaigns, "calibrate": CALIBRATE}), encoding="utf-8")
    common = ["--config", str(path), "--run", str(tmp_path / "run"), "--json", "--quiet"]
    found = {}
    for stage in ("identify-frame", "calibrate"):
        assert run([stage, *common]) == 0
        found[stage] = json.loads(capsys.readouterr().out)
    [line] = [item for item in found["identify-frame"]["doubts"] if item.startswith("floor 2: ")]
    assert any(item.endswith(line) for item in found["calibrate"]["warnings"])
    [artifact] = (tmp_path / "run").rglob("frame.h5")
    assert line in storage.doubts_of(Artifact(artifact))


def test_a_clean_identification_has_no_doubts() -> None:
    test = sweep_test(FRAME, np.random.default_rng(1), Rig(noise=0.01, rate=100.0, sweep_s=80.0))
    tests = FrameTests((test,), (), np.diag(FRAME.mass), Path("campaign.yaml"))
    assert identify_frame(tests, IdentificationOptions()).doubts == ()


@pytest.mark.literature
def test_one_degree_of_freedom_from_file_to_design(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Gains, steady response and resonance of an oscillator with a viscous device are those of the textbook."""
    mass, omega, own, amplitude = 100.0, 8.0, 0.01, 0.5
    device = 0.2
    path = tmp_path / "run.yaml"
    settings = {
        "campaigns": {"bench": None, "frame": None, "closed_loop": None},
        "structure": {"storeys": [{"mass_kg": mass, "stiffness_n_m": mass * omega**2}], "damping_ratio": [own]},
        "calibrate": {
            **CALIBRATE,
            "neural": {"starts": 1, "iterations": 1, "hidden": [2], "amplitudes": 2, "frequencies": 2},
            "map_points": 5,
            "vd": {"c_n_s_m": 2.0 * device * mass * omega},
        },
        "simulate": {
            "damper": "set-c",
            "tracking": "continuous",
            "controller": {"inverse": "model"},
            "excitation": {"base_amplitude_m_s2": amplitude, "frequency_rad_s": 6.4, "decay_s": 0.0},
        },
        "resonance": {"points": 5},
        "design": {"laws": ["vd"], "grid": 3, "evaluations": 3, "draws": 0},
    }
    path.write_text(yaml.safe_dump(settings), encoding="utf-8")
    common = ["--config", str(path), "--run", str(tmp_path / "run"), "--json", "--quiet"]
    found = {}
    for name, stage in (
        ("calibrate", ["calibrate"]),
        ("simulate", ["simulate", "--law", "vd"]),
        ("resonance", ["simulate", "--law", "vd", "--resonance"]),
        ("design", ["design"]),
    ):
        assert run([*stage, *common]) == 0, capsys.readouterr().err
        found[name] = json.loads(capsys.readouterr().out)
    assert found["calibrate"]["omega_inf"] is None
    assert found["calibrate"]["laws"]["vd"]["damping_ratio_exact_with_frame"] == pytest.approx(own + device)

    def rms(ratio: float) -> float:
        return amplitude / omega**2 / np.sqrt(2.0 * ((1.0 - ratio**2) ** 2 + (2.0 * (own + device) * ratio) ** 2))

    assert found["simulate"]["rms_x_top_m"] == pytest.approx(rms(0.8), rel=1e-3)
    peak = np.sqrt(1.0 - 2.0 * (own + device) ** 2)
    assert found["resonance"]["resonance_rad_s"] == pytest.approx(omega * peak, rel=0.02)
    assert found["resonance"]["peak_rms_x_top_m"] == pytest.approx(rms(peak), rel=2e-3)
    assert found["design"]["best"] == "vd"
