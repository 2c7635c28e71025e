"""Artifacts list the files that were read, with the SHA-256 that other programs find."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact
from mrpipe.pipeline.files_read import files_read
from mrpipe.pipeline.fingerprint import FileHashes

from .conftest import STAGES, MakePipeline

pytestmark = pytest.mark.property


def _sum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _campaign(folder: Path) -> Path:
    folder.mkdir()
    t = np.arange(0.0, 1.0, 0.01)
    for name in ("a", "b"):
        np.savetxt(folder / f"{name}.csv", np.column_stack([t, np.sin(t)]), delimiter=",", header="t,x", comments="")
    (folder / "campaign.yaml").write_text(
        f"campaign: {folder.name}\nrig: shear-frame\nchannels:\n  time: {{column: t, unit: s}}\n"
        "  ground_acceleration: {column: x, unit: m/s^2}\n"
        "tests:\n  - {name: a, file: a.csv, role: training}\n  - {name: b, file: b.csv, role: training}\n"
    )
    return folder


@pytest.fixture
def hashes(tmp_path: Path) -> FileHashes:
    return FileHashes(tmp_path / "memory.json")


def test_an_artifact_lists_the_files_of_its_campaign(make_pipeline: MakePipeline, tmp_path: Path) -> None:
    campaign = _campaign(tmp_path / "tower")
    first = replace(STAGES["first"], inputs=("campaign:frame",), optional_inputs=("campaign:bench",))
    stages = {**STAGES, "first": first}
    pipeline = make_pipeline(stages, campaigns={"bench": None, "frame": str(campaign), "closed_loop": None})
    pipeline.build("second")
    names = ("campaign.yaml", "a.csv", "b.csv")
    found = json.loads(Artifact(pipeline.run_directory / "first.h5").root["inputs"])
    assert found == {name: _sum(campaign / name) for name in names}
    second = json.loads(Artifact(pipeline.run_directory / "second.h5").root["inputs"])
    assert second == {"first.h5": _sum(pipeline.run_directory / "first.h5")}


def test_files_of_one_name_are_told_apart(hashes: FileHashes, tmp_path: Path) -> None:
    bench, frame = _campaign(tmp_path / "bench"), _campaign(tmp_path / "frame")
    (bench / "b.csv").rename(bench / "c.csv")
    (bench / "campaign.yaml").write_text((bench / "campaign.yaml").read_text().replace("b.csv", "c.csv"))
    found = files_read({"campaign:bench": bench, "campaign:frame": frame}, {}, (), hashes)
    assert set(found) == {
        "bench/campaign.yaml", "bench/a.csv", "c.csv", "frame/campaign.yaml", "frame/a.csv", "b.csv",
    }  # fmt: skip
    assert found["bench/campaign.yaml"] == _sum(bench / "campaign.yaml")
    # folders of one name too
    (tmp_path / "other").mkdir()
    other = _campaign(tmp_path / "other" / "frame")
    found = files_read({"campaign:closed-loop": other, "campaign:frame": frame}, {}, (), hashes)
    assert len(found) == 6
    assert found[str(other / "a.csv")] == _sum(other / "a.csv")


def test_files_that_settings_name_are_listed(hashes: FileHashes, tmp_path: Path) -> None:
    motion = tmp_path / "motion.csv"
    motion.write_text("0,0\n")
    settings = {"simulate.motion": {"file": str(motion)}, "simulate.law": "vd", "prepare.cutoff_hz": 5.0}
    assert files_read({}, settings, (), hashes) == {"motion.csv": _sum(motion)}


def test_public_data_are_listed_by_their_path(
    hashes: FileHashes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "public" / "motions").mkdir(parents=True)
    file = tmp_path / "public" / "motions" / "a.txt"
    file.write_text("1")
    monkeypatch.setenv("MRPIPE_DATA", str(tmp_path / "public"))
    assert files_read({}, {}, ("motions", "none"), hashes) == {"motions/a.txt": _sum(file)}
