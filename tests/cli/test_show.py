"""`show` prints tables in the user's units, and says what to do with a run directory, a data file or a JSON result."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts.hdf5 import ArtifactWriter, Provenance
from mrpipe.campaigns.proposal import propose_campaigns
from mrpipe.cli import run
from tests.campaigns.plausibility.rig import sound_tests
from tests.campaigns.proposal.rigs import bench_folder
from tests.cli.test_check import project


def shown(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    """Return the lines that `mrpipe show` prints."""
    assert run(["show", *arguments]) == 0
    return capsys.readouterr().out.splitlines()


@pytest.mark.golden
def test_a_campaign_is_a_table_in_the_units_of_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = bench_folder(tmp_path / "files", 4)
    (proposal,) = propose_campaigns(folder, "own", None, tmp_path / "own")
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "campaign.yaml").write_text(proposal.text, encoding="utf-8")
    lines = shown(capsys, str(tmp_path / "own"))
    assert lines[0] == "campaign own: damper-bench, 4 tests (3 training, 1 validation), 16 s"
    assert lines[1].split() == [
        *("test", "role", "Hz", "s", "force", "[kN]", "displacement", "[mm]", "drive", "[mA]", "findings"),
    ]
    first = lines[3].split()
    assert first[:4] == ["versuch_00", "training", "1000", "4"] and first[-1] == "-"
    assert float(first[5]) == pytest.approx(5.0, abs=0.1) and first[6] == "0"


@pytest.mark.golden
def test_findings_stand_in_the_row_and_below(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tests = sound_tests(6)
    tests[3] = replace(tests[3], force_n=-tests[3].force_n)
    project(tmp_path, tests)
    lines = shown(capsys, str(tmp_path / "data"))
    (row,) = [line for line in lines if line.strip().startswith("T3 ")]
    assert row.endswith("sign-reversed")
    assert any(line.startswith("error: test T3, force: ") for line in lines)
    assert run(["show", str(tmp_path / "data"), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["plausibility"][0]["name"] == "sign-reversed" and content["tests"][0]["sampling_rate_hz"] == 1000.0


@pytest.mark.golden
def test_a_data_file_suggests_init(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = bench_folder(tmp_path / "files", 1, samples=300)
    lines = shown(capsys, str(folder / "versuch_00.csv"))
    assert "Kraft (kN)" in "\n".join(lines) and "force" in "\n".join(lines)
    assert lines[-1] == f"next: propose a campaign with `mrpipe init DIR --from {folder}`"
    assert run(["show", str(folder)]) == 2
    assert f"mrpipe init DIR --from {folder}" in capsys.readouterr().err


@pytest.mark.golden
def test_a_json_result_is_printed_and_an_unreadable_one_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "close-loop.json").write_text('{"verdict": "backlash", "before": {"nrmse": 0.1}}', encoding="utf-8")
    assert "  verdict: backlash" in shown(capsys, str(tmp_path / "close-loop.json"))
    (tmp_path / "close-loop.json").write_text("{", encoding="utf-8")
    assert run(["show", str(tmp_path / "close-loop.json")]) == 2
    assert "is not JSON that can be read" in capsys.readouterr().err


@pytest.mark.golden
def test_an_artifact_shows_single_values_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with ArtifactWriter.create(tmp_path / "a.h5", Provenance("stage")) as artifact:
        artifact.put("gain", 67.49, unit="N/m")
    (row,) = [line.split() for line in shown(capsys, str(tmp_path / "a.h5")) if line.strip().startswith("gain")]
    assert row == ["gain", "scalar", "N/m", "67.49"]


@pytest.mark.golden
def test_a_run_directory_lists_its_stages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = project(tmp_path)
    assert run(["prepare", "--config", str(config), "--run", str(tmp_path / "run"), "--quiet"]) == 0
    capsys.readouterr()
    lines = shown(capsys, str(tmp_path / "run"))
    assert lines[0] == f"run directory {tmp_path / 'run'}"
    assert any(line.split()[:1] == ["prepare"] and "prepared.h5" in line for line in lines)
    assert lines[-1] == f"next: mrpipe status {tmp_path / 'run'}"


@pytest.mark.property
def test_a_damaged_artifact_is_one_line_with_its_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "prepared.h5"
    with ArtifactWriter.create(path, Provenance("prepare")) as artifact:
        for number in range(10):
            artifact.put(f"x{number}", np.zeros(200), unit="m", dims=("time",))
    content, found = path.read_bytes(), 0
    for place in range(500, len(content), len(content) // 9):
        path.write_bytes(content[:place] + b"\xff" * 64 + content[place + 64 :])
        if run(["show", str(path)]) == 2:
            (line,) = capsys.readouterr().err.splitlines()
            assert line.startswith(f"mrpipe: {path}")
            found += 1
    assert found > 0


@pytest.mark.golden
def test_missing_samples_of_a_data_file_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gaps.csv"
    rows = [f"{0.01 * k:.2f},{'NaN' if k in (3, 7) else k},{k % 5}" for k in range(60)]
    path.write_text("t [s],x [mm],F [N]\n" + "\n".join(rows) + "\n")
    lines = shown(capsys, str(path))
    assert any("missing samples" in line for line in lines)
    assert next(line for line in lines if "x [mm]" in line).split()[-1] == "2"


@pytest.mark.golden
def test_an_unknown_declared_effect_is_a_warning_with_the_valid_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project(tmp_path, declared_effects=["backlsh", "heating"])
    (line,) = [line for line in shown(capsys, str(tmp_path / "data")) if line.startswith("warning: ")]
    assert "declared_effects[0]: 'backlsh' is not an effect" in line and "did you mean backlash?" in line
    assert "remanence" in line and "joint-friction" not in line
    assert run(["show", str(tmp_path / "data"), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["plausibility"]
    assert (found["name"], found["severity"]) == ("effect-unknown", "warning")
