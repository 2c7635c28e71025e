"""The command `mrpipe reproduce`: what it reads of a run, and what it prints."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from mrpipe.config.model import config_model
from mrpipe.stages.registry import all_stages
from mrpipe.stages.reproduce import READ

SETTINGS = ["--set", "reproduce.source=sets", "--set", "reproduce.chapters=[3]"]


@pytest.mark.property
def test_a_run_is_read_unless_the_sets_are_wanted() -> None:
    stage = all_stages()["reproduce"]
    assert set(stage.for_configuration(config_model()(name="a")).inputs) == set(READ)
    sets = config_model().model_validate({"name": "a", "reproduce": {"source": "sets"}})
    assert stage.for_configuration(sets).inputs == ()
    # the order of the stages does not follow from conditional inputs
    names = list(all_stages())
    assert all(names.index(name) < names.index("reproduce") for name in READ)


@pytest.mark.property
def test_command_without_a_run(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mrpipe", "reproduce", "--run", str(tmp_path / "run"), *SETTINGS, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    assert {claim["chapter"] for claim in printed["claims"]} == {3}
    assert sum(printed["counts"].values()) == len(printed["claims"])
    text = (tmp_path / "run" / "reproduce.md").read_text(encoding="utf-8")
    assert "| B1 |" in text and "Checks of this project" in text
    assert not (tmp_path / "run" / "prepared.h5").exists()
