"""The main job as a user starts it: whole, again, killed and resumed; on a small rig so that it is quick."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

from mrpipe.pipeline.fingerprint import digest_of_artifact
from tests.small_project import MAIN_JOB

pytestmark = pytest.mark.property

SMALL = {
    "name": "small",
    **MAIN_JOB,
    "sweep": {
        **MAIN_JOB["sweep"],
        "states": [["velocity"], ["displacement"]],
        "past_values": [0, 3],
        "neurons": [3, 6],
    },
}
"""A sweep of several networks, so that the job is also killed in the middle of it."""

ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def _command(directory: Path, *extra: str) -> list[str]:
    config = directory / "small.yaml"
    config.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    run = str(directory / "run")
    return [sys.executable, "-m", "mrpipe", "run", str(config), "--run", run, "--jobs", "1", "--json", *extra]


def _artifacts(directory: Path) -> dict[str, str]:
    return {path.name: digest_of_artifact(path) for path in sorted((directory / "run").glob("*.h5"))}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """A run from start to end, and how long it took."""
    directory = tmp_path_factory.mktemp("undisturbed")
    started = time.monotonic()
    done = subprocess.run(_command(directory), capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert done.returncode == 0, done.stderr
    assert {stage["outcome"] for stage in json.loads(done.stdout)["stages"].values()} == {"built"}
    return directory, time.monotonic() - started


def test_run_directory_holds_what_the_contract_says(undisturbed: tuple[Path, float]) -> None:
    run = undisturbed[0] / "run"
    for name in ("config.yaml", "log.txt", "report.html", "report.md", "prepared.h5", "training.h5", "forward.h5"):
        assert (run / name).is_file(), name
    assert any((run / "figures").iterdir())
    assert any((run / "tables").iterdir())
    assert [path.name for path in run.rglob("*.tmp")] == []


def test_second_run_builds_nothing_and_prints_the_same(undisturbed: tuple[Path, float]) -> None:
    directory, _ = undisturbed
    before = _artifacts(directory)
    done = subprocess.run(_command(directory), capture_output=True, text=True, env=ENVIRONMENT, check=True)
    stages = json.loads(done.stdout)["stages"]
    assert {stage["outcome"] for stage in stages.values()} == {"reused"}
    assert stages["train-inverse"]["summary"]["validation_nrmse"] > 0
    assert _artifacts(directory) == before


def test_killed_ten_times_and_resumed_gives_the_same(undisturbed: tuple[Path, float], tmp_path: Path) -> None:
    """kill -9 at random moments leaves old or new files, and the next call goes on at the first unfinished stage."""
    reference, seconds = undisturbed
    moments = random.Random(7)
    for _ in range(10):
        process = subprocess.Popen(
            _command(tmp_path),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=ENVIRONMENT,
            start_new_session=True,
        )
        try:
            process.wait(moments.uniform(0.05, 0.4) * seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    done = subprocess.run(_command(tmp_path), capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert done.returncode == 0, done.stderr
    assert _artifacts(tmp_path) == _artifacts(reference)


def test_run_until_a_stage_stops_there(tmp_path: Path) -> None:
    done = subprocess.run(
        _command(tmp_path, "--until", "prepare"), capture_output=True, text=True, env=ENVIRONMENT, check=True
    )
    assert list(json.loads(done.stdout)["stages"]) == ["record-bench", "prepare"]
    assert not (tmp_path / "run" / "training.h5").exists()
