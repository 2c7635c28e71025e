"""Artifacts are netCDF-4 files: xarray reads axes and units; scales change neither results nor digests."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.pipeline.fingerprint import digest_of_artifact
from mrpipe.reporting.contents import describe_file


def write(path: Path) -> Path:
    with ArtifactWriter.create(path, Provenance("test")) as artifact:
        artifact.put("time", np.arange(5.0), unit="s", dims=("time",))
        artifact.put("tests/one/force", np.arange(5.0), unit="N", dims=("time",))
        artifact.put("tests/two/force", np.arange(8.0), unit="N", dims=("time",))
        artifact.put("frame/mass", np.eye(3), unit="kg", dims=("floor", "floor_of_cause"))
        artifact.put("frame/square", np.eye(3), unit="1", dims=("floor", "floor"))
        artifact.put("scalar", 2.0, unit="1")
        artifact.put("empty", np.zeros(0), unit="1", dims=("nothing",))
        artifact.put_json("note", {"a": 1})
    return path


@pytest.mark.oracle
def test_xarray_reads_axes_and_units(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray", reason="needs xarray")
    pytest.importorskip("h5netcdf", reason="needs h5netcdf")
    path = write(tmp_path / "a.h5")
    with xarray.open_dataset(path, engine="h5netcdf", group="frame") as frame:
        assert frame["mass"].dims == ("floor", "floor_of_cause")
        assert frame["mass"].attrs["unit"] == "kg"
        assert len(set(frame["square"].dims)) == 2
        np.testing.assert_array_equal(frame["mass"].values, np.eye(3))
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        lengths = {name: tree[f"tests/{name}/force"].sizes for name in ("one", "two")}
    assert [list(item.values()) for item in lengths.values()] == [[5], [8]]
    assert all(name.startswith("time") for item in lengths.values() for name in item)


@pytest.mark.property
def test_scales_are_no_content(tmp_path: Path) -> None:
    path = write(tmp_path / "a.h5")
    artifact = Artifact(path)
    assert artifact.members() == ["time", "tests", "frame", "scalar", "empty", "note"]
    assert set(artifact.attributes("frame/mass")) == {"unit", "dims"}
    names = {row["name"] for row in describe_file(path)["datasets"]}
    assert names == {
        "time", "tests/one/force", "tests/two/force", "frame/mass", "frame/square", "scalar", "empty", "note",
    }  # fmt: skip
    before = digest_of_artifact(path)
    with h5py.File(path, "a") as handle:
        for name in ("floor", "floor_2", "floor_of_cause", "time_2", "time_3", "nothing"):
            handle.pop(name, None)
    assert digest_of_artifact(path) == before
