"""From the options of a command to a run directory."""

from pathlib import Path

import pytest

from mrpipe.cli import run
from mrpipe.cli.options import CommonOptions
from mrpipe.cli.session import load, session
from mrpipe.errors import UserError
from tests.cli.test_check import project


@pytest.mark.property
@pytest.mark.parametrize(("named", "warned"), [(False, True), (True, False)])
def test_a_run_of_another_configuration_is_named_unless_the_command_names_one(
    named: bool, warned: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--run` alone takes the default configuration, which builds the stages of the other one again."""
    (tmp_path / "manifests").mkdir()
    kept = tmp_path / "config.yaml"
    kept.write_text("name: tower\nseed: 3\n")
    given = tmp_path / "given.yaml"
    given.write_text("name: thesis\n")
    with session(CommonOptions(config=given if named else None, run=tmp_path)) as pipeline:
        assert pipeline.run_directory == tmp_path
    said = capsys.readouterr().err
    assert (f"--config {kept}" in said and "made with the configuration tower" in said) is warned


@pytest.mark.property
def test_a_run_of_the_same_configuration_is_continued_in_silence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for _ in range(2):
        with session(CommonOptions(run=tmp_path)):
            pass
    assert "was made with" not in capsys.readouterr().err


_FRAME = """campaign: tower
rig: shear-frame
sampling_rate_hz: 200.0
declared_effects: []
frame: {floor_masses_kg: [5.95]}
channels:
  ground_acceleration: {column: a, unit: m/s^2, scale: 1.0}
  floor_acceleration_1: {column: b, unit: m/s^2, scale: 1.0}
tests:
- {name: sweep, file: sweep.h5, role: training, kind: sweep}
"""


@pytest.mark.property
@pytest.mark.parametrize(
    ("named", "overrides", "searched"), [(False, [], True), (True, [], False), (False, ["x"], False)]
)
def test_modes_over_amplitude_are_looked_for_in_a_measured_frame(
    named: bool, overrides: list[str], searched: bool, tmp_path: Path
) -> None:
    """The default configuration does not look for them, because its virtual frame is linear."""
    (tmp_path / "campaign.yaml").write_text(_FRAME)
    given = tmp_path / "given.yaml"
    given.write_text("name: given\nidentify_frame: {amplitude_dependence: false}\n")
    changes = ["identify_frame.amplitude_dependence=false"] if overrides else []
    options = CommonOptions(config=given if named else None, campaign=tmp_path, overrides=changes)
    assert load(options).config.identify_frame.amplitude_dependence is searched


@pytest.mark.property
def test_a_directory_that_no_run_has_written_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("of the user")
    with (
        pytest.raises(UserError, match=r"holds report.html, which no run has written; give an empty or new directory"),
        session(CommonOptions(run=tmp_path)),
    ):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    # a run that was killed before its first stage ended goes on
    killed = tmp_path / "killed"
    with session(CommonOptions(run=killed)):
        (killed / "figures").mkdir()
    with session(CommonOptions(run=killed)) as pipeline:
        assert pipeline.run_directory == killed
    earlier = tmp_path / "killed-before-its-configuration"
    earlier.mkdir()
    for name in (".lock", ".config.yaml.1.tmp", "log.txt"):
        (earlier / name).touch()
    with session(CommonOptions(run=earlier)) as pipeline:
        assert pipeline.run_directory == earlier
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    (hidden / ".gitkeep").touch()
    with session(CommonOptions(run=hidden)):
        pass


@pytest.mark.property
def test_an_unknown_stage_is_named_with_its_line(tmp_path: Path) -> None:
    config = tmp_path / "own.yaml"
    config.write_text("name: own\nstages:\n  - prepare\n  - trian-forward\n")
    said = r"own.yaml: line 4, stages\[1\]: no such stage 'trian-forward'; did you mean train-forward"
    with pytest.raises(UserError, match=said), session(CommonOptions(config=config, run=tmp_path / "run")):
        pass


@pytest.mark.property
def test_the_report_alone_needs_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "own.yaml"
    config.write_text("name: own\nstages: [report]\n", encoding="utf-8")
    assert run(["run", "--config", str(config), "--run", str(tmp_path / "run")]) == 2
    assert "own.yaml: line 2, stages: lists the report alone, and no stage has run in " in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.property
@pytest.mark.parametrize("what", ["inverse", "damper", "frame", "controller", "all"])
def test_an_export_without_data_changes_nothing(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "own.yaml"
    config.write_text("name: own\ncampaigns: {bench: null, frame: null, closed_loop: null}\n", encoding="utf-8")
    command = ["export", what, "--config", str(config), "--run", str(tmp_path / "new" / "run")]
    assert run(command) == 2
    assert "line 2, campaigns." in (said := capsys.readouterr().err) and "is null, and export-" in said
    assert not (tmp_path / "new").exists()
    # results of an earlier run in the same directory, with another configuration, are kept
    results = tmp_path / "new" / "run"
    (results / "manifests").mkdir(parents=True)
    for name in ("prepared.h5", "training.h5", "inverse.h5", "damper.h5", "frame.h5"):
        (results / name).write_text("a result", encoding="utf-8")
    (results / "config.yaml").write_text("name: earlier\n", encoding="utf-8")
    assert run(command) == 2
    kept = {path.name: path.read_text(encoding="utf-8") for path in results.glob("*.h5")}
    assert len(kept) == 5 and set(kept.values()) == {"a result"}
    assert (results / "config.yaml").read_text(encoding="utf-8") == "name: earlier\n"


@pytest.mark.property
@pytest.mark.parametrize("command", [["status"], ["check"], ["report"], ["status", "--json"]])
def test_a_command_that_only_looks_makes_no_run_directory(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = project(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run([*command, "--config", str(config)]) == (2 if command == ["report"] else 0)
    assert not (tmp_path / "runs").exists()


@pytest.mark.property
def test_an_export_of_everything_names_what_is_wrong_with_the_campaign(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = project(tmp_path)
    file = tmp_path / "data" / "campaign.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("unit: N", "unit: NN"), encoding="utf-8")
    assert run(["export", "all", "--config", str(config), "--run", str(tmp_path / "run")]) == 2
    error = capsys.readouterr().err
    assert "'NN': is not a unit" in error and "needs two drives" not in error


@pytest.mark.property
def test_a_run_for_which_the_memory_is_too_small_leaves_no_new_directory(tmp_path: Path) -> None:
    options = CommonOptions(config=project(tmp_path), run=tmp_path / "run", quiet=True)
    with pytest.raises(MemoryError), session(options):
        raise MemoryError
    assert not (tmp_path / "run").exists()
