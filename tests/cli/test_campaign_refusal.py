"""A campaign that stages cannot work with is refused before anything is built, and nothing is left behind."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.cli import run
from mrpipe.cli.options import CommonOptions
from mrpipe.cli.session import session
from mrpipe.cli.stage_commands import _without_constant_drive
from mrpipe.errors import UserError
from mrpipe.pipeline.runner import Pipeline
from tests.campaigns.plausibility.rig import sound_tests

from .test_check import project

pytestmark = pytest.mark.planted


def _with_nan() -> list[Any]:
    tests = sound_tests(4)
    force = tests[1].force_n.copy()
    force[100] = np.nan
    tests[1] = replace(tests[1], force_n=force)
    return tests


def _with_a_short_test() -> list[Any]:
    tests = sound_tests(4)
    short = {name: getattr(tests[1], name)[:50] for name in ("time_s", "displacement_m", "drive", "force_n")}
    tests[1] = replace(tests[1], **short)
    return tests


def _with_one_drive() -> list[Any]:
    return [replace(test, drive=np.full_like(test.drive, 0.5)) for test in sound_tests(4)]


def _with_inverse(config: Path) -> Path:
    text = config.read_text(encoding="utf-8")
    config.write_text(text.replace("[prepare, assemble, identify-damper]", "[train-inverse, report]"), encoding="utf-8")
    return config


@pytest.mark.parametrize(
    ("tests", "expected"),
    [
        (_with_nan(), "T1.h5: test T1, force, row 100: is NaN"),
        (_with_a_short_test(), "T1.h5: test T1: has 50 samples"),
        (_with_one_drive(), "campaign.yaml: drive: never changes in the training tests (0.5)"),
    ],
    ids=["nan", "short", "one drive"],
)
@pytest.mark.parametrize("command", ["run", "train-inverse"])
def test_a_wrong_campaign_is_refused_before_any_stage(
    command: str, tests: list[Any], expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = _with_inverse(project(tmp_path, tests))
    assert run([command, str(config), "--run", str(tmp_path / "runs" / "own"), "--quiet"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert expected in line
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("name", ["backlsh", "joint-frction"])
def test_an_unknown_declared_effect_is_refused_before_any_stage(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = project(tmp_path, declared_effects=["heating", name])
    assert run(["close-loop", str(config), "--run", str(tmp_path / "runs" / "own"), "--quiet"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "campaign.yaml: line" in line and f"declared_effects[1]: unknown effect '{name}'" in line
    assert not (tmp_path / "runs").exists()


def test_one_drive_is_no_fault_where_no_inverse_model_is_asked_for(tmp_path: Path) -> None:
    config = project(tmp_path, _with_one_drive())
    assert run(["run", str(config), "--run", str(tmp_path / "run"), "--until", "assemble", "--quiet"]) == 0


def test_a_campaign_that_stages_accepted_is_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = project(tmp_path)
    arguments = ["run", str(config), "--run", str(tmp_path / "run"), "--until", "assemble", "--quiet"]
    assert run(arguments) == 0
    monkeypatch.setattr("mrpipe.campaigns.load_campaign", None)
    assert run(arguments) == 0


def test_a_doubtful_test_is_no_reason_to_refuse(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tests = sound_tests(4)
    tests[1] = replace(tests[1], force_n=-tests[1].force_n)
    config = project(tmp_path, tests)
    assert run(["check", str(config), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["errors"] > 0
    assert run(["run", str(config), "--run", str(tmp_path / "run"), "--until", "prepare", "--quiet"]) == 0


def test_files_of_others_and_results_stay(tmp_path: Path) -> None:
    """An empty directory that was there before stays, and so does a run with results."""
    there = tmp_path / "there"
    there.mkdir()
    config = project(tmp_path)
    good, run_directory = ["prepare", str(config), "--quiet", "--run"], tmp_path / "run"
    assert run([*good, str(run_directory)]) == 0
    project(tmp_path, _with_nan())
    assert run([*good, str(run_directory)]) == 2
    assert (run_directory / "prepared.h5").is_file()
    assert run([*good, str(there)]) == 2
    assert there.is_dir()


def test_an_export_of_everything_leaves_out_what_needs_an_inverse_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = project(tmp_path, _with_one_drive())
    with session(CommonOptions(config=config, run=tmp_path / "run", quiet=True)) as pipeline:
        assert _without_constant_drive(pipeline, ["export-damper", "export-inverse"]) == ["export-damper"]
    assert "export-inverse is left out: the drive never changes" in capsys.readouterr().err


def test_an_export_command_of_everything_builds_what_one_drive_allows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = project(tmp_path, _with_one_drive())
    built: list[str] = []

    def build(_: Pipeline, name: str) -> Any:
        built.append(name)
        raise UserError("stage", name, "is not built in this test", "nothing")

    monkeypatch.setattr(Pipeline, "build", build)
    assert run(["export", "all", "--config", str(config), "--run", str(tmp_path / "run"), "--quiet"]) == 2
    # the first of those that are left is built; without the rule the command had refused all of them before
    assert built == ["export-damper"]
    said = capsys.readouterr().err
    assert "export-controller is left out: the drive never changes" in said and "export-inverse is left out" in said
