"""Which configuration and run a call works in; help, demo, and configurations with and without --config."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from mrpipe.cli import run
from mrpipe.cli.options import CommonOptions
from mrpipe.cli.session import load, run_directory
from mrpipe.config.loader import default_config_path, load_config
from mrpipe.errors import UserError

CONFIG = "stages: [prepare]\ncampaigns: {bench: laboratory, frame: null, closed_loop: null}\n"
CAMPAIGN = """\
campaign: Prüfstand 3/b
rig: damper-bench
sampling_rate_hz: 1000
channels: {displacement: {column: x, unit: mm}, drive: {column: i, unit: A}, force: {column: F, unit: N}}
tests: [{name: a, file: a.csv, role: training}]
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "configs").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _campaign(folder: Path) -> Path:
    folder.mkdir()
    (folder / "campaign.yaml").write_text(CAMPAIGN, encoding="utf-8")
    return folder


@pytest.mark.property
def test_the_only_configuration_of_a_project_is_taken(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "configs" / "my-rig.yaml").write_text(CONFIG)
    for command in (["status"], ["check"]):
        assert run([*command, "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        assert document.get("run", "runs/my-rig") == "runs/my-rig"
        assert document.get("config", "my-rig.yaml").endswith("my-rig.yaml")


@pytest.mark.property
def test_several_configurations_are_asked_for(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.yaml", "b.yaml"):
        (project / "configs" / name).write_text(CONFIG)
    assert run(["status"]) == 2
    assert "holds 2 configurations (configs/a.yaml, configs/b.yaml); name one with --config" in capsys.readouterr().err
    assert run(["status", "configs/b.yaml"]) == 0
    (project / "configs" / "thesis.yaml").write_text(CONFIG)
    assert default_config_path() == Path("configs/thesis.yaml")


@pytest.mark.property
def test_without_a_configuration_the_way_on_is_said(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prepare"]) == 2
    assert "mrpipe demo" in capsys.readouterr().err
    (project / "configs").rmdir()
    assert run(["status"]) == 0
    captured = capsys.readouterr()
    assert "there is no project here" in captured.err
    assert "mrpipe demo" in captured.err
    assert "prepare" in captured.out


@pytest.mark.property
def test_a_campaign_on_the_command_line_names_run_and_title(project: Path) -> None:
    (project / "configs" / "my-rig.yaml").write_text(CONFIG)
    options = CommonOptions(campaign=_campaign(project / "data"))
    loaded = load(options)
    assert run_directory(options, loaded) == Path("runs/Prüfstand-3-b")
    assert loaded.config.report.title == "Prüfstand 3/b"
    assert loaded.config.campaigns.bench == str(project / "data")
    named = CommonOptions(campaign=options.campaign, overrides=["name=other"], run=Path("elsewhere"))
    assert load(named).config.name == "other"
    assert run_directory(named, load(named)) == Path("elsewhere")


@pytest.mark.property
def test_virtual_data_do_not_enter_a_run_of_measured_data(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _campaign(project / "data")
    (project / "configs" / "my-rig.yaml").write_text("campaigns: {bench: ../data, frame: null, closed_loop: null}\n")
    assert run(["record", "--rig", "bench"]) == 2
    assert "virtual data do not enter it" in capsys.readouterr().err
    assert not (project / "runs").exists()


@pytest.mark.property
def test_a_configuration_is_taken_with_and_without_the_option(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = project / "own.yaml"
    path.write_text(CONFIG)
    for arguments in (
        ["check", str(path)],
        ["check", "--config", str(path)],
        ["check", str(path), "--config", str(path)],
    ):
        assert run([*arguments, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["config"] == str(path)
    assert run(["run", "--config", "a.yaml", "b.yaml"]) == 2
    assert "are two configurations; give one of them" in capsys.readouterr().err
    for command in ("run", "prepare", "close-loop", "identify-damper"):
        assert run([command, "nowhere.yaml", "--run", str(project / "run")]) == 2
        assert "nowhere.yaml: no such configuration" in capsys.readouterr().err
    campaign = _campaign(project / "data") / "campaign.yaml"
    assert run(["run", str(campaign)]) == 2
    assert f"is a campaign and not a configuration; use --campaign {project / 'data'}" in capsys.readouterr().err


@pytest.mark.property
def test_a_campaign_that_a_command_does_not_read_is_refused(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    campaign = _campaign(project / "data")
    for frame in ("null", "laboratory"):
        (project / "configs" / "a.yaml").write_text(CONFIG.replace("frame: null", f"frame: {frame}"))
        assert run(["identify-frame", "--campaign", str(campaign)]) == 2
        said = capsys.readouterr().err
        assert "holds a damper-bench campaign; identify-frame reads a campaign of a structure" in said


@pytest.mark.property
def test_closed_loop_tests_alone_do_not_show_modes(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    campaign = _campaign(project / "data")
    text = CAMPAIGN.replace("damper-bench", "shear-frame").replace("role: training", "kind: closed-loop")
    (campaign / "campaign.yaml").write_text(text.replace("displacement:", "floor_displacement_1:"), encoding="utf-8")
    (project / "configs" / "a.yaml").write_text(CONFIG)
    assert run(["identify-frame", "--campaign", str(campaign)]) == 2
    said = capsys.readouterr().err
    assert "holds closed-loop tests; identify-frame reads a campaign of a structure with sweep, random, ambient" in said


@pytest.mark.property
def test_the_bare_name_and_help_explain(capsys: pytest.CaptureFixture[str]) -> None:
    pages = []
    for arguments in ([], ["help"], ["--help"]):
        assert run(arguments) == 0
        pages.append(capsys.readouterr().out)
    assert pages[0] == pages[1] == pages[2]
    for heading in ("Start:", "Damper:", "Structure and control:", "Examples:", "--install-completion"):
        assert heading in pages[0]
    assert run(["help", "close-loop"]) == 0
    assert "Usage: mrpipe close-loop" in capsys.readouterr().out
    assert run(["help", "clse-loop"]) == 2
    assert "did you mean close-loop?" in capsys.readouterr().err


@pytest.mark.property
def test_completion_can_be_shown(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHELL", "/bin/bash")
    import subprocess
    import sys

    # the shell is named: there is none above a worker of the test suite that could be detected
    done = subprocess.run(
        [sys.executable, "-m", "mrpipe", "--show-completion", "bash"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
    )
    assert "_MRPIPE_COMPLETE" in done.stdout


@pytest.mark.property
def test_the_demo_is_valid_and_uses_one_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import mrpipe.cli.demo_command as demo_command

    seen: list[CommonOptions] = []
    monkeypatch.setattr(demo_command, "run_stages", seen.append)
    assert run(["demo"]) == 0
    assert seen[0].run == Path("runs/demo")
    assert seen[0].config is not None
    config = load_config(seen[0].config).config
    assert config.stages[-1] == "report"
    assert config.campaigns.bench == "laboratory"


@pytest.mark.property
def test_a_default_that_is_ambiguous_is_no_guess(project: Path) -> None:
    with pytest.raises(UserError, match="holds no configuration"):
        default_config_path()
