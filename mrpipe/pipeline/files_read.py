"""Names and SHA-256 of the files that a stage reads, as its artifact lists them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from mrpipe.artifacts import public_data_directory
from mrpipe.pipeline.fingerprint import FileHashes, files_in
from mrpipe.pipeline.sources import CAMPAIGN


def files_read(
    inputs: Mapping[str, Path], settings: Mapping[str, Any], public_data: Sequence[str], hashes: FileHashes
) -> dict[str, str]:
    """Return name -> SHA-256 of the bytes of each file that a stage reads, as `sha256sum` prints it.

    A file of a campaign has its name in the campaign. Where two files have one name, the folder stands before it.

    Parameters
    ----------
    inputs
        Declared input -> path of the artifact or campaign; those that do not exist are left out.
    settings
        Dotted name -> value; every file that a value names is listed.
    public_data
        Folders of the public data that the stage reads.
    hashes
        Digests that are known.

    Raises
    ------
    UserError
        If campaign.yaml is faulty.
    """
    found: dict[Path, Path] = {}  # file -> the folder that its name is relative to
    for name, path in inputs.items():
        base = path if path.is_dir() else path.parent
        found |= dict.fromkeys(_files_of_input(name, path), base)
    found |= {path: path.parent for value in settings.values() for path in files_in(value)}
    public = public_data_directory()
    if public is not None:
        found |= dict.fromkeys((file for name in public_data for file in _files_below(public / name)), public)
    return {name: hashes.sha256(path) for path, name in _names(found).items() if path.is_file()}


def _files_of_input(name: str, path: Path) -> Iterable[Path]:
    if not path.exists():
        return ()
    if name.startswith(CAMPAIGN):
        from mrpipe.campaigns import campaign_files

        return campaign_files(path)
    return _files_below(path) if path.is_dir() else (path,)


def _files_below(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.rglob("*")) if path.is_file())


def _names(files: Mapping[Path, Path]) -> dict[Path, str]:
    """Return a different name for each file; as short as possible."""
    relative = {path: _relative(path, base) for path, base in files.items()}
    with_folder = {path: f"{base.name}/{relative[path]}" for path, base in files.items()}
    names = relative
    for longer in (with_folder, {path: str(path) for path in files}):
        count = Counter(names.values())
        names = {path: name if count[name] == 1 else longer[path] for path, name in names.items()}
    return names


def _relative(path: Path, base: Path) -> str:
    return path.relative_to(base).as_posix() if path.is_relative_to(base) else path.name
