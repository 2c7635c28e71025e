"""An export that replaces that of another damper says so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from mrpipe.artifacts import load_parameter_set
from mrpipe.cli import run
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.exports.damper import about_damper
from mrpipe.exports.replaced import replaced_export

pytestmark = pytest.mark.property


@pytest.mark.parametrize("source", ["identified", "traced", "set-c", "my dampers/one.h5"])
def test_the_damper_of_an_export_is_read_from_its_readme(source: str, tmp_path: Path) -> None:
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    (tmp_path / "README.md").write_text(f"# Exported damper: damper\n\n{about_damper(damper, source)}\n")
    assert replaced_export(tmp_path, source) == ""
    assert f" held the export with the {'damper ' if '-' in source or '/' in source else ''}{source}" in (
        replaced_export(tmp_path, "another")
    )


@pytest.mark.parametrize("text", ["", "# My notes\n", '{"damper": 3'])
def test_files_that_are_no_export_are_not_judged(text: str, tmp_path: Path) -> None:
    assert replaced_export(tmp_path, "traced") == ""
    (tmp_path / "README.md").write_text(text)
    assert replaced_export(tmp_path, "traced") == ""
    (tmp_path / "controller.json").write_text(text)
    assert replaced_export(tmp_path, "traced") == ""


@pytest.mark.parametrize("what", ["damper", "controller"])
def test_a_message_says_which_damper_was_replaced(
    what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "rig.yaml"
    content = {
        "campaigns": {"bench": None, "frame": None, "closed_loop": None},
        "structure": {"storeys": [{"mass_kg": 10.0, "stiffness_n_m": 1.0e4, "repeat": 2}]},
        "calibrate": {"damper": "set-c", "expected_amplitude_m": 0.01},
        "simulate": {"controller": {"inverse": "model"}},
    }
    config.write_text(yaml.safe_dump(content), encoding="utf-8")
    options = ["--config", str(config), "--run", str(tmp_path / "run"), "--json"]
    first = ["export", what, "--damper", "set-c", *options]
    assert run(first) == 0
    printed = capsys.readouterr()
    assert "held the export" not in printed.err
    folder = Path(json.loads(printed.out)["folder"])
    # the same damper again, and then another one
    assert run([*first, "--force"]) == 0 and "held the export" not in capsys.readouterr().err
    assert run(["export", what, "--damper", "p4-1000kn", *options]) == 0
    said = f"{folder.name}/ held the export with the damper set-c, which is replaced by that with the damper p4-1000kn"
    assert said in capsys.readouterr().err
