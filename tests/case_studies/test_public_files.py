"""Names of the public data and paths."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.case_studies.public_files import named_file
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

PUBLIC = {"elcentro": "records/elcentro.mat", "kobe": "records/kobe.mat"}


def test_a_name_is_a_file_of_the_public_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MRPIPE_DATA", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert named_file("--motion", "elcentro", PUBLIC) == tmp_path / "records" / "elcentro.mat"
    # a file of this name here is meant first
    (tmp_path / "kobe").write_text("1 2\n", encoding="utf-8")
    assert named_file("--motion", "kobe", PUBLIC) == Path("kobe")


@pytest.mark.parametrize("path", ["my/quake", "quake.csv"])
def test_a_path_stays_a_path(path: str) -> None:
    assert named_file("--motion", path, PUBLIC) == Path(path)


def test_a_misspelt_name_is_refused_with_the_nearest_one() -> None:
    with pytest.raises(UserError, match="is neither a file nor a name; did you mean elcentro"):
        named_file("--motion", "elcentr", PUBLIC)


def test_without_the_public_data_a_name_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrpipe.case_studies.public_files.public_data_directory", lambda: None)
    with pytest.raises(UserError, match="set MRPIPE_DATA"):
        named_file("--motion", "elcentro", PUBLIC)
