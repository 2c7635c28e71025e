"""Errors of the system, of damaged files and of the user are one line, status 2, and a document with --json."""

from __future__ import annotations

import errno
import json
import os
import resource
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.cli import run
from mrpipe.cli.boundary import as_user_error
from mrpipe.errors import UserError
from mrpipe.pipeline.stage import StageContext
from mrpipe.stages import registry, train_inverse

ROOT = Path(__file__).resolve().parents[2]
SYSTEM = {
    "full": (
        OSError(errno.ENOSPC, "x", "runs/a/prepared.h5"),
        "runs/a/prepared.h5: no space left on device; make space",
    ),
    "forbidden": (PermissionError(errno.EACCES, "x", "/sys/x"), "/sys/x: permission denied; give permission"),
    "read-only": (OSError(errno.EROFS, "x", "/r"), "/r: read-only file system; choose a directory"),
    "link": (
        FileExistsError(errno.EEXIST, "x", "runs/a"),
        "runs/a: file exists; choose another name: this is a file, or a link",
    ),
    "long": (OSError(errno.ENAMETOOLONG, "x", "aaa"), "aaa: file name too long; choose a shorter name"),
    "hdf5": (OSError("Unable to synchronously open file (truncated file)"), "truncated file"),
    "hdf5 read": (RuntimeError("Can't decode chunk"), "HDF5 file: is damaged"),
    "hdf5 key": (KeyError("Unable to open object (bad object header)"), "HDF5 file: is damaged"),
    "memory": (
        MemoryError("Unable to allocate 37 GiB"),
        "memory: is exhausted: Unable to allocate 37 GiB; use",
    ),
    "depth": (RecursionError(), "input: is nested too deeply"),
    "end": (EOFError(), "ends too early"),
    "letters": (UnicodeEncodeError("ascii", "ü", 0, 1, "x"), "cannot be written as ascii; set PYTHONIOENCODING=utf-8"),
}


@pytest.mark.property
@pytest.mark.parametrize("name", SYSTEM)
def test_an_error_of_the_system_is_one_line_status_2_and_a_document(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import mrpipe.cli.session as session

    error, expected = SYSTEM[name]

    def raises(*_: object) -> None:
        raise error

    monkeypatch.setattr(session, "load", raises)
    assert run(["calibrate", "--json"]) == 2
    captured = capsys.readouterr()
    assert expected.lower() in captured.err.lower()
    assert len(captured.err.strip().splitlines()) == 1
    document = json.loads(captured.out)
    assert document["error"]["message"] in captured.err
    assert document["error"]["exit_status"] == 2
    assert document["error"]["remedy"]


@pytest.mark.property
def test_a_fault_of_the_program_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    import mrpipe.cli.session as session

    def raises(*_: object) -> None:
        raise KeyError("gamma")

    monkeypatch.setattr(session, "load", raises)
    with pytest.raises(KeyError):
        run(["calibrate"])
    assert as_user_error(KeyError("gamma")) is None


@pytest.mark.property
def test_a_users_mistake_is_a_document_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["show", "nowhere.h5", "--json"]) == 2
    document = json.loads(capsys.readouterr().out)["error"]
    assert (document["source"], document["problem"]) == ("nowhere.h5", "no such file or directory")
    assert run(["prepare", "--sed", "1", "--json"]) == 2
    assert "No such option" in json.loads(capsys.readouterr().out)["error"]["message"]


@pytest.mark.property
def test_a_full_disk_is_an_error_and_no_crash_and_leaves_no_file(tmp_path: Path) -> None:
    code = (
        "import resource, sys\nfrom pathlib import Path\nimport numpy as np\n"
        "from mrpipe.artifacts import ArtifactWriter, Provenance\n"
        "import signal\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "try:\n"
        "    with ArtifactWriter.create(Path(sys.argv[1]), Provenance('prepare')) as artifact:\n"
        "        for k in range(20):\n"
        "            artifact.put(f'x{k}', np.random.default_rng(k).normal(size=5000), unit='m', dims=('time',))\n"
        "except OSError as error:\n    print(error.errno)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "prepared.h5")], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(errno.EFBIG)
    assert list(tmp_path.iterdir()) == []
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


@pytest.mark.property
def test_a_damaged_artifact_names_its_file(tmp_path: Path) -> None:
    path = tmp_path / "training.h5"
    with ArtifactWriter.create(path, Provenance("assemble")) as artifact:
        artifact.put("x", np.random.default_rng(1).normal(size=20000), unit="m", dims=("time",))
    content, found = path.read_bytes(), 0
    for place in range(len(content) // 4, len(content), len(content) // 23):
        path.write_bytes(content[:place] + b"\xff" * 64 + content[place + 64 :])
        try:
            Artifact(path).array("x")
        except UserError as error:
            found += 1
            assert str(path) in str(error)
    assert found > 0


@pytest.mark.property
def test_status_looks_at_a_directory_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "own.yaml"
    config.write_text("stages: [prepare]\ncampaigns: {bench: laboratory, frame: null, closed_loop: null}\n")
    directory = tmp_path / "run"
    (directory / "manifests").mkdir(parents=True)
    (directory / "manifests" / ".hashes.json").mkdir()  # nothing can be saved there, even by an administrator
    assert run(["status", str(directory), "--config", str(config)]) == 0
    assert "prepare" in capsys.readouterr().out


@pytest.mark.property
@pytest.mark.parametrize("closed", ["2>&-", ">&-", "<&-"])
def test_a_closed_stream_ends_nothing(closed: str) -> None:
    done = subprocess.run(
        f"{sys.executable} -m mrpipe show nowhere --json {closed}", shell=True, cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.property
def test_letters_that_the_terminal_lacks_are_escaped(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    command = [sys.executable, "-m", "mrpipe", "init"]
    plain, as_json = (
        subprocess.run([*command, str(place), *more], cwd=ROOT, env=environment, capture_output=True, text=True)
        for place, more in ((tmp_path / "dämpfer", []), (tmp_path / "dämpfer2", ["--json"]))
    )
    assert plain.returncode == 0, plain.stderr
    assert "d\\xe4mpfer" in plain.stdout
    assert json.loads(as_json.stdout)["directory"] == str(tmp_path / "dämpfer2")


@pytest.mark.property
def test_run_goes_on_past_what_is_impossible(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    """A stage refuses its input: the training set and the report are made, and the line names what is wrong."""
    data = tmp_path / "data"
    data.mkdir()
    t = np.arange(0.0, 6.0, 0.002)
    for name, frequency, current in (("train", 1.0, 2.0), ("less", 1.0, 1.0), ("valid", 1.3, 2.0)):
        x = 0.008 * np.sin(2.0 * np.pi * frequency * t)
        v = np.gradient(x, t)
        rows = np.column_stack([t, x, np.full_like(t, current), 100.0 * np.tanh(v / 0.005) + 600.0 * v])
        np.savetxt(data / f"{name}.csv", rows, delimiter=",", header="t,x,i,F", comments="")
    (data / "campaign.yaml").write_text(
        "campaign: own\nrig: damper-bench\nchannels:\n  time: {column: t, unit: s}\n"
        "  displacement: {column: x, unit: m}\n  drive: {column: i, unit: A}\n  force: {column: F, unit: N}\n"
        "tests:\n  - {name: train, file: train.csv, role: training}\n"
        "  - {name: less, file: less.csv, role: training}\n"
        "  - {name: valid, file: valid.csv, role: validation}\n"
    )
    config = tmp_path / "own.yaml"
    config.write_text(
        "stages: [prepare, assemble, train-inverse, report]\ncampaigns: {bench: data, frame: null, closed_loop: null}\n"
    )

    def impossible(context: StageContext) -> Mapping[str, Any]:
        raise UserError(context.inputs["assemble"], "drive", "never changes", "record another current")

    # the sweep that the real stage reads takes a minute
    inverse = replace(train_inverse.STAGE, inputs=("assemble",), optional_inputs=(), run=impossible)
    monkeypatch.setattr(train_inverse, "STAGE", inverse)
    registry.all_stages.cache_clear()
    request.addfinalizer(registry.all_stages.cache_clear)
    assert run(["run", str(config), "--run", str(tmp_path / "run"), "--json", "--quiet"]) == 2
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert {name: stage["outcome"] for name, stage in document["stages"].items()} == {
        "prepare": "built", "assemble": "built", "train-inverse": "failed",
    }  # fmt: skip
    assert document["failed"] == ["train-inverse"]
    assert "drive: never changes" in document["stages"]["train-inverse"]["failed"]
    assert "training.h5: drive: never changes; record another current (1 stage failed" in captured.err
    page = (tmp_path / "run" / "report.md").read_text(encoding="utf-8")
    assert "never changes" in page
    with h5py.File(tmp_path / "run" / "training.h5") as handle:
        assert handle.attrs["stage"] == "assemble"
    # alone, the stage is a mistake of the user
    assert run(["train-inverse", "--config", str(config), "--run", str(tmp_path / "run"), "--quiet"]) == 2
