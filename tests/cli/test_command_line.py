"""Exit statuses, one-line messages, clean JSON, and a start without heavy imports."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from mrpipe.cli import run

from .test_check import project

pytestmark = pytest.mark.property

COMMANDS = [
    "run", "record", "prepare", "assemble", "sweep", "train-forward", "train-inverse", "identify-damper",
    "identify-frame", "calibrate", "simulate", "close-loop", "benchmark", "reproduce", "report", "export", "init",
    "status", "show", "check", "compare",
]  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_of_the_contract_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--help"]) == 0
    out = capsys.readouterr().out
    assert "Usage: mrpipe" in out
    assert "--json" in out


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    out = capsys.readouterr().out
    assert [command for command in COMMANDS if f"  {command} " not in out] == []


def test_help_imports_nothing_heavy() -> None:
    code = "import sys\nfrom mrpipe.cli import run\nrun(['--help'])\nprint(sorted(sys.modules), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"numpy", "scipy", "h5py", "pandas", "sklearn", "numba", "matplotlib", "pint", "pydantic", "jinja2"}
    assert heavy & set(eval_list(done.stderr)) == set()


def eval_list(text: str) -> list[str]:
    return [name.strip(" '[]\n") for name in text.split(",")]


MISTAKES = {
    "unknown command": (["trian"], "No such command"),
    "no command at all": (["xyzzy"], "No such command 'xyzzy'. `mrpipe help` lists the commands."),
    "unknown option": (["prepare", "--cofnig", "x"], "No such option"),
    "missing config": (["run", "nowhere.yaml"], "nowhere.yaml: no such configuration"),
    "data file as config": (
        ["run", "README.md"],
        "README.md: is not a configuration, because it does not end in .yaml",
    ),
    "unknown setting": (["prepare", "--set", "prepare.cutof_hz=3"], "did you mean cutoff_hz?"),
    "unknown effect": (["check", "--set", "close_loop.candidates=[remanance]"], "did you mean remanence?"),
    "settings file missing": (["prepare", "--settings", "no.yaml"], "--settings: no.yaml: no such file"),
    "unknown law": (["simulate", "--law", "vdn"], "did you mean vd"),
    "law missing": (["simulate"], "--law: is missing; one of vd, vdps"),
    "law of the export": (["export", "--law", "vdn"], "vdn: is not a control law; did you mean vdns?"),
    "run in the working directory": (["prepare", "--run", ""], "is the working directory"),
    "name of a path": (["prepare", "--set", "name=../x"], "--set: name, '../x': is not the name of a directory"),
    "until what is not there": (["run", "--until", "prepair"], "did you mean prepare?"),
    "until part of a name": (["run", "--until", "train"], "--until: train: no such stage; did you mean"),
    "unknown format": (
        ["export", "forward", "--format", "onxx"],
        "--format: onxx: is not a format; did you mean onnx",
    ),
    "format of a controller": (
        ["export", "controller", "--format", "matlab"],
        "--format: matlab: is not a format of controller; leave --format out; it is written as c and json",
    ),
    "format of a script": (["export", "opensees", "--format", "c"], "is not a format of opensees"),
    "prefix of C names": (
        ["export", "controller", "--set", "export.prefix=9x"],
        "is '9x'; a name of letters, digits and _ expected, which does not begin with a digit",
    ),
    "no campaign": (["prepare", "--campaign", "nowhere"], "nowhere"),
    "no file to show": (["show", "nowhere.h5"], "nowhere.h5: no such file or directory"),
    "no picture": (["show", "README.md", "--plot", "x.txt"], "end it in .png, .svg or .pdf"),
    "no rig": (["record", "--rig", "table"], "--rig: table: is not a rig; one of bench, frame, closed-loop"),
    "nothing to export": (["export", "plant"], "export: plant: cannot be exported"),
    "no run to report": (["report", "nowhere"], "no such run directory"),
    "file in place of a run": (["report", "README.md"], "README.md: is a file and no run directory; name a directory"),
    "file in place of a run, status": (["status", "README.md"], "README.md: is a file and no run directory"),
    "file in place of a run, compare": (["compare", "README.md", "docs"], "README.md: is a file and no run directory"),
    "no run in a directory": (["report", "tests"], "tests: is not a run directory, because it has no manifests"),
    "no run for status": (["status", "nowhere"], "no such run directory"),
    "no run in a directory, status": (
        ["status", "tests"],
        "tests: is not a run directory, because it has no manifests",
    ),
    "no such damper": (
        ["simulate", "--law", "vd", "--damper", "trased"],
        "--damper: trased: no such damper; identified, traced, a file, or one of the known sets: ",
    ),
    "no such damper to design": (["design", "--damper", "trased"], "--damper: trased: no such damper"),
    "no such damper to export": (["export", "damper", "--damper", "x.h5"], "no such artifact"),
    "negative jobs": (["prepare", "--jobs", "0"], "--jobs"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_is_one_line_and_status_2(mistake: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    arguments, expected = MISTAKES[mistake]
    if arguments[0] in {"prepare", "simulate", "run"} and not {"--run", "name=../x"} & set(arguments):
        arguments = [*arguments, "--run", str(tmp_path / "run")]
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert expected in captured.err
    assert len(captured.err.strip().splitlines()) == 1


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("mrpipe ")


def test_check_prints_one_json_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "thesis", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["valid"] is True


def test_check_reads_the_configuration_that_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("campaigns: {bench: null, frame: null, closed_loop: null}\n", encoding="utf-8")
    assert run(["check", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["config"] == str(path)


def test_explain_lists_settings_with_values(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "thesis", "--explain", "--set", "prepare.cutoff_hz=77"]) == 0
    assert "prepare.cutoff_hz = 77" in capsys.readouterr().out


def test_init_lays_out_a_project_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", str(tmp_path / "rig")]) == 0
    assert (tmp_path / "rig" / "data" / "rig" / "campaign.yaml").is_file()
    assert run(["init", str(tmp_path / "rig")]) == 2
    assert "exists already" in capsys.readouterr().err


def test_interrupt_is_130(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    import mrpipe.cli.session as session

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(session, "load", interrupted)
    assert run(["calibrate"]) == 130
    assert "resumes at the first unfinished stage" in capsys.readouterr().err


def test_status_imports_no_compiler_and_no_numerics(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom mrpipe.cli import run\nrun(['status', '--config', 'thesis'])\n"
        "print(sorted(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"numba", "scipy", "sklearn", "pandas", "matplotlib", "pint", "jinja2", "joblib"}
    assert heavy & set(eval_list(done.stderr)) == set()
    assert "prepare" in done.stdout


@pytest.mark.parametrize(
    ("command", "default"),
    [("prepare", "or of the campaign of --campaign"), ("record", "name of the configuration."), ("demo", "runs/demo")],
)
def test_the_help_of_run_names_no_option_that_the_command_lacks(
    command: str, default: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([command, "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert default in text and ("--campaign" in text) == (command == "prepare")


def test_check_and_report_take_the_options_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = str(project(tmp_path))
    assert run(["check", config, "--run", str(tmp_path / "run"), "--seed", "3", "--quiet"]) == 0
    assert run(["report", "--campaign", str(tmp_path / "data"), "--run", str(tmp_path / "run")]) == 2
    assert "no such run directory" in capsys.readouterr().err
