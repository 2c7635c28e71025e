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
