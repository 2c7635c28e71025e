"""Artifacts: atomic, readable with h5py alone, honest about their origin."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import array_shapes, arrays

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance, atomic_write_text
from mrpipe.errors import UserError


def _write(path: Path) -> None:
    with ArtifactWriter.create(path, Provenance("prepare", "name: x", {"campaign": "abc"}, 7)) as artifact:
        artifact.put("tests/one/force", np.arange(2000.0), unit="N", dims=("time",), description="measured")
        artifact.put("count", 3, unit="1")
        artifact.put_json("note", {"a": [1, 2.5, None], "b": "ü"})
        artifact.attributes("tests/one", role="training", sampling_rate_hz=200.0)


@pytest.mark.property
def test_every_dataset_has_unit_and_dims_for_h5py_alone(tmp_path: Path) -> None:
    _write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as handle:
        assert handle.attrs["stage"] == "prepare"
        names: list[str] = []
        handle.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        assert all({"unit", "dims"} <= set(handle[name].attrs) for name in names)
        assert list(handle["tests/one/force"].attrs["dims"]) == ["time"]


@pytest.mark.property
def test_reads_what_was_written(tmp_path: Path) -> None:
    _write(tmp_path / "a.h5")
    artifact = Artifact(tmp_path / "a.h5")
    assert artifact.stage == "prepare"
    assert artifact.array("tests/one/force")[-1] == 1999.0
    assert artifact.scalar("count") == 3.0
    assert artifact.json("note") == {"a": [1, 2.5, None], "b": "ü"}
    assert artifact.unit("tests/one/force") == "N"
    assert artifact.attributes("tests/one") == {"role": "training", "sampling_rate_hz": 200.0}
    assert artifact.members("tests") == ["one"]
    assert artifact.members("none") == []
    assert "tests/one/force" in artifact


@pytest.mark.property
@given(values=arrays(np.float64, array_shapes(max_dims=3, max_side=5)))
def test_any_array_comes_back_bit_for_bit(values: np.ndarray, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("artifact") / "a.h5"
    with ArtifactWriter.create(path, Provenance("test")) as artifact:
        artifact.put("x", values, unit="m", dims=tuple(f"axis_{index}" for index in range(values.ndim)))
    assert Artifact(path).array("x").tobytes() == values.tobytes()


@pytest.mark.property
def test_dims_must_name_every_axis(tmp_path: Path) -> None:
    with (
        pytest.raises(ValueError, match="x: 2 axes"),
        ArtifactWriter.create(tmp_path / "a.h5", Provenance("test")) as artifact,
    ):
        artifact.put("x", np.zeros((2, 2)), unit="m", dims=("time",))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.property
def test_other_files_are_refused_in_one_line(tmp_path: Path) -> None:
    text = tmp_path / "text.h5"
    text.write_text("no HDF5")
    with pytest.raises(UserError, match="not a readable HDF5 file"):
        Artifact(text)
    with h5py.File(tmp_path / "foreign.h5", "w") as handle:
        handle["x"] = 1.0
    with pytest.raises(UserError, match="attribute schema"):
        Artifact(tmp_path / "foreign.h5")


@pytest.mark.property
def test_missing_dataset_is_named(tmp_path: Path) -> None:
    _write(tmp_path / "a.h5")
    with pytest.raises(UserError, match="none: no such dataset"):
        Artifact(tmp_path / "a.h5").array("none")


@pytest.mark.property
def test_old_text_stays_until_the_new_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "note.txt"
    atomic_write_text(path, "old")
    atomic_write_text(path, "new")
    assert path.read_text() == "new"
    assert [item.name for item in path.parent.iterdir()] == ["note.txt"]


@pytest.mark.property
def test_an_error_of_writing_names_the_file_and_no_temporary_one(tmp_path: Path) -> None:
    import errno

    from mrpipe.artifacts import atomic_path

    with pytest.raises(OSError, match="No space") as full, atomic_path(tmp_path / "a.csv"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert full.value.filename == str(tmp_path / "a.csv")
    assert list(tmp_path.iterdir()) == []
