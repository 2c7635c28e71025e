"""Stages that do not need each other run at the same time, and nothing else changes."""

from __future__ import annotations

import functools
import logging
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from mrpipe.config.loader import LoadedConfig
from mrpipe.config.model import config_model
from mrpipe.errors import StageFailed, UserError
from mrpipe.pipeline import side_by_side
from mrpipe.pipeline.execution import StageRunner
from mrpipe.pipeline.fingerprint import FileHashes
from mrpipe.pipeline.runner import Pipeline
from mrpipe.pipeline.side_by_side import build_side_by_side
from mrpipe.pipeline.stage import Stage, StageContext

pytestmark = pytest.mark.property

LONGEST_WAIT_S = 30.0


def _write(context: StageContext, value: float) -> Mapping[str, Any]:
    with context.write(f"{context.stage}.h5") as artifact:
        artifact.put("value", value + context.rng.normal(), unit="m")
    return {"value_m": value}


def _meets(context: StageContext) -> Mapping[str, Any]:
    """Wait until the other one has started, which happens only if both run at the same time."""
    context.run_directory.mkdir(parents=True, exist_ok=True)
    context.log.info("%s is here", context.stage)
    context.warn("a warning from another process")
    (context.run_directory / f"{context.stage}-is-here").touch()
    other = {"left": "right", "right": "left"}[context.stage]
    end = time.monotonic() + LONGEST_WAIT_S
    while not (context.run_directory / f"{other}-is-here").exists():
        if time.monotonic() > end:
            raise RuntimeError(f"{other} did not start")
        time.sleep(0.01)
    context.report.text("Both were here.")
    return _write(context, 1.0)


def _after(context: StageContext) -> Mapping[str, Any]:
    return _write(context, sum(float(context.artifact(name).scalar("value")) for name in context.inputs))


def _wrong_input(context: StageContext) -> Mapping[str, Any]:
    raise UserError("tests.csv", "row 3", "is not a number", "give a number")


def _fault(context: StageContext) -> Mapping[str, Any]:
    return {"never": 1 / 0}


def _killed(context: StageContext) -> Mapping[str, Any]:
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


def _no_process(*_: Any) -> None:
    raise AssertionError("a process was started")


def _stage(name: str, run: Any, inputs: tuple[str, ...] = ()) -> Stage:
    return Stage(name, name, run, inputs=inputs, outputs=(f"{name}.h5",))


STAGES = {
    stage.name: stage
    for stage in (
        _stage("left", _meets),
        _stage("right", _meets),
        _stage("both", _after, ("left", "right")),
        _stage("last", _after, ("both",)),
        _stage("alone", _after),
        _stage("more", _after, ("alone",)),
        _stage("wrong", _wrong_input),
        _stage("needs-wrong", _after, ("wrong",)),
        _stage("fault", _fault),
        _stage("killed", _killed),
    )
}


def _pipeline(directory: Path, jobs: int) -> Pipeline:
    content = {"campaigns": {"bench": None, "frame": None, "closed_loop": None}}
    loaded = LoadedConfig(config_model().model_validate(content), directory / "config.yaml")
    logger = logging.getLogger("side by side")
    return Pipeline(loaded, STAGES, directory / "run", logger, jobs=jobs, quiet=True, keep_going=True)


def _runner(directory: Path) -> StageRunner:
    """Return what runs a stage in another process."""
    runner = _pipeline(directory, 2).runner
    runner.logger.setLevel(logging.INFO)
    return runner


def _built(directory: Path, names: Sequence[str], jobs: int = 2) -> Pipeline:
    pipeline = _pipeline(directory, jobs)
    build_side_by_side(pipeline, names, functools.partial(_runner, directory))
    return pipeline


def test_two_stages_meet_and_results_are_those_of_one_after_the_other(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        pipeline = _built(tmp_path / "two", ["last"])
    assert [(item.stage, item.what) for item in pipeline.outcomes.values()] == [
        ("left", "built"),
        ("right", "built"),
        ("both", "built"),
        ("last", "built"),
    ]
    assert pipeline.outcomes["left"].manifest.warnings == ["a warning from another process"]
    assert {"left is here", "left: a warning from another process"} <= set(caplog.messages)
    assert (tmp_path / "two" / "run" / "report-parts" / "left.json").is_file()
    one = tmp_path / "one"
    (one / "run").mkdir(parents=True)
    for name in ("left", "right"):  # so that neither waits
        (one / "run" / f"{name}-is-here").touch()
    alone = _built(one, ["last"], jobs=1)
    for name in ("left", "right", "both", "last"):
        assert alone.outcomes[name].manifest.outputs == pipeline.outcomes[name].manifest.outputs
    # what the processes learnt of files is known to the run, and to the next one
    assert str((tmp_path / "two" / "run" / "left.h5").resolve()) in pipeline.hashes._known
    again = _built(tmp_path / "two", ["last"])
    assert {item.what for item in again.outcomes.values()} == {"reused"}


def test_a_chain_of_stages_starts_no_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(side_by_side, "StageProcess", _no_process)
    assert [item.what for item in _built(tmp_path, ["more"]).outcomes.values()] == ["built", "built"]


def test_errors_of_another_process_are_those_of_this_one(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    pipeline = _built(tmp_path, ["wrong", "needs-wrong", "fault", "alone"])
    said = {name: item.manifest.failed for name, item in pipeline.outcomes.items()}
    assert said["wrong"] == "tests.csv: row 3: is not a number; give a number"
    assert said["needs-wrong"] == "not built, because wrong failed"
    assert said["fault"].startswith("ZeroDivisionError: division by zero (a fault of the program")
    assert said["alone"] == ""
    assert {type(error) for error in pipeline.errors} == {UserError, StageFailed, ZeroDivisionError}
    # the log shows where the fault is
    assert "in _fault" in caplog.text
    assert 'return {"never": 1 / 0}' in caplog.text


def test_a_process_that_is_killed_fails_its_stage_only(tmp_path: Path) -> None:
    pipeline = _built(tmp_path, ["killed", "alone", "more"])
    assert "its process was ended by signal 9" in pipeline.outcomes["killed"].manifest.failed
    assert pipeline.outcomes["more"].what == "built"


def test_without_keep_going_an_error_ends_the_processes(tmp_path: Path) -> None:
    pipeline = _pipeline(tmp_path, 2)
    pipeline.keep_going = False
    with pytest.raises(UserError, match="row 3"):
        build_side_by_side(pipeline, ["wrong", "left"], functools.partial(_runner, tmp_path))


CALLER = """
import sys
from pathlib import Path
from tests.pipeline.test_side_by_side import _built

if __name__ == "__main__":
    _built(Path(sys.argv[1]), ["left", "alone"])
"""


def test_processes_end_with_the_run_that_is_killed(tmp_path: Path) -> None:
    """`kill -9` of a run frees its directory, so nothing may write there any more."""
    script = tmp_path / "caller.py"
    script.write_text(CALLER)
    root = Path(__file__).resolve().parents[2]
    process = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)], env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{root}"}
    )
    here = tmp_path / "run" / "left-is-here"
    end = time.monotonic() + LONGEST_WAIT_S
    while not here.exists() and time.monotonic() < end:
        time.sleep(0.05)
    started = _processes_of(script)
    process.kill()
    process.wait()
    end = time.monotonic() + LONGEST_WAIT_S / 2
    while (left := _processes_of(script)) and time.monotonic() < end:
        time.sleep(0.05)
    assert here.exists()
    assert len(started) >= 1
    assert left == []


def _processes_of(script: Path) -> list[str]:
    """Return the processes of stages that a script started: its directory is first in their PYTHONPATH."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            environment = (entry / "environ").read_bytes()
            command = (entry / "cmdline").read_bytes()
        except OSError:
            continue
        if b"spawn_main" in command and f"PYTHONPATH={script.parents[0]}".encode() in environment:
            found.append(entry.name)
    return found


def test_an_error_of_the_user_is_copied_whole() -> None:
    error = UserError("tests.csv", "row 3", "is not a number", "give a number")
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.where, copy.remedy) == (str(error), "row 3", "give a number")


def test_digests_that_another_process_learnt_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("1")
    there, here = FileHashes(tmp_path / "there.json"), FileHashes(tmp_path / "here.json")
    value = there.digest(path)
    here.learn(there.take_new())
    assert there.take_new() == {}
    here.save()
    assert next(iter(FileHashes(tmp_path / "here.json")._known.values()))[-1] == value
