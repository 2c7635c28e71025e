"""Digests tell every change of a file, an artifact or a setting, and nothing else."""

from __future__ import annotations

import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from mrpipe.config.model import config_model
from mrpipe.pipeline.fingerprint import MISSING, FileHashes, digest_of_artifact, plain_settings
from mrpipe.stages.registry import all_stages

from .conftest import STAGES, MakePipeline


@pytest.fixture
def hashes(tmp_path: Path) -> FileHashes:
    return FileHashes(tmp_path / "memory.json")


def _artifact(path: Path, values: object) -> Path:
    with h5py.File(path, "w") as handle:
        handle.attrs["mrpipe_version"] = "0"
        if isinstance(values, str | list):
            handle.create_dataset("text", data=values, dtype=h5py.string_dtype())
        else:
            handle["values"] = values
    return path


@pytest.mark.property
@pytest.mark.parametrize(
    ("one", "other"),
    [
        (np.zeros(6), np.zeros((2, 3))),
        (np.zeros(2), np.zeros(4, dtype=np.float32)),
        (np.zeros(1), np.float64(0.0)),
        (["a", "b"], ["a", "c"]),
        ("a", "b"),
    ],
)
def test_digest_of_an_artifact_holds_shape_type_and_text(one: object, other: object, tmp_path: Path) -> None:
    first, again, second = (
        digest_of_artifact(_artifact(tmp_path / f"{name}.h5", values))
        for name, values in (("a", one), ("b", one), ("c", other))
    )
    assert first == again != second


@pytest.mark.property
@pytest.mark.parametrize("how", ["written again", "replaced"])
def test_equal_size_and_restored_time_are_noticed(how: str, tmp_path: Path, hashes: FileHashes) -> None:
    path = tmp_path / "data.csv"
    path.write_text("1.0")
    before, times = hashes.digest(path), path.stat()
    if how == "written again":
        path.write_text("2.0")
    else:
        other = tmp_path / "other.csv"
        other.write_text("2.0")
        other.replace(path)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert hashes.digest(path) != before
    hashes.save()
    assert FileHashes(tmp_path / "memory.json").digest(path) == hashes.digest(path)


@pytest.mark.property
@pytest.mark.parametrize("content", ["", "[]", "null", "5", '{"x": 3}', "{", "\x00"])
def test_a_damaged_memory_of_hashes_counts_as_empty(content: str, tmp_path: Path) -> None:
    memory, path = tmp_path / "memory.json", tmp_path / "data.csv"
    path.write_text("1.0")
    expected = FileHashes(tmp_path / "none.json").digest(path)
    memory.write_text(content.replace('"x"', f'"{path.resolve()}"'))
    assert FileHashes(memory).digest(path) == expected


@pytest.mark.property
def test_a_missing_file_has_a_digest_of_its_own(tmp_path: Path, hashes: FileHashes) -> None:
    assert hashes.digest(tmp_path / "none.csv") == MISSING


@pytest.mark.property
def test_an_artifact_with_flipped_bytes_has_another_digest_and_no_error(tmp_path: Path, hashes: FileHashes) -> None:
    path = tmp_path / "training.h5"
    with h5py.File(path, "w") as handle:
        handle.attrs["mrpipe_version"] = "0"
        handle.create_dataset("values", data=np.random.default_rng(1).normal(size=5000), compression="gzip")
    whole = hashes.digest(path)
    content = path.read_bytes()
    for place in np.random.default_rng(2).integers(0, len(content), 40):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :])
        assert hashes.digest(path) != whole or path.read_bytes() != content


_NAMED = {
    "simulate": lambda file: {"excitation": {"file": file}},
    "identify_frame": lambda file: {"mode_matrix": file},
    "laboratory": lambda file: {"damper": file},
    "benchmark": lambda file: {"ten_storey": {"structures": [file], "motion": {"file": file}}},
    "close_loop": lambda file: {"effect_files": [file]},
}


@pytest.mark.property
@pytest.mark.parametrize("section", _NAMED)
def test_the_content_of_a_file_that_a_setting_names_counts(section: str, tmp_path: Path, hashes: FileHashes) -> None:
    file = tmp_path / "own.yaml"
    file.write_text("1.0")
    config = config_model().model_validate({section: _NAMED[section](str(file))})
    before = plain_settings(config, [section], hashes)
    assert plain_settings(config, [section], hashes) == before
    file.write_text("2.0")
    assert plain_settings(config, [section], hashes) != before
    file.unlink()
    assert plain_settings(config, [section], hashes) not in (before, {})


@pytest.mark.property
def test_a_bare_word_is_no_file(tmp_path: Path, hashes: FileHashes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "identified").write_text("a file that has the name of a value by chance")
    assert list(plain_settings(config_model()(), ["simulate"], hashes)) == ["simulate"]


@pytest.mark.property
def test_public_measurements_that_a_stage_reads_count(
    make_pipeline: MakePipeline, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    monkeypatch.setenv("MRPIPE_DATA", str(tmp_path / "public"))
    record = tmp_path / "public" / "ground_motions" / "a.dat"
    record.parent.mkdir(parents=True)
    record.write_text("1.0")
    stages = {**STAGES, "first": replace(STAGES["first"], public_data=("ground_motions",))}
    make_pipeline(stages).build("first")
    assert make_pipeline(stages).build("first").what == "reused"
    record.write_text("2.0")
    assert make_pipeline(stages).status(["first"])["first"] == ["input public data changed"]


@pytest.mark.property
def test_stages_that_read_public_records_say_so() -> None:
    said = {name for name, stage in all_stages().items() if stage.public_data}
    assert said == {"reproduce", "benchmark-ten-storey", "benchmark-base-isolated", "benchmark-wind"}
