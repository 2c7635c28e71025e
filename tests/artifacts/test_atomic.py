"""Files that are either the old or the new version: what an error names."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from mrpipe.artifacts.atomic import atomic_path


@pytest.mark.property
def test_an_error_of_a_read_only_place_names_the_file_and_not_the_temporary_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    final = tmp_path / "figure.png"

    def refuse(path: Path, *_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system", str(path))

    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(OSError, match="Read-only") as caught, atomic_path(final) as temporary:
        refuse(temporary)
    assert caught.value.filename == str(final)
