"""Content hashes of the inputs of a result: files, artifacts and settings.

The hashes of code are those of :mod:`mrpipe.pipeline.code_version`.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

MISSING = "missing"
"""Digest of a file that does not exist."""

BYTES = " (bytes)"
"""End of the name under which the digest of the bytes of an artifact is remembered."""

# how the artifact was made, not part of its content
_NOT_CONTENT = {
    "created_utc",
    "config",
    "inputs",
    "mrpipe_version",
    "numpy_version",
    "scipy_version",
    "scikit-learn_version",
}


def digest_of_artifact(path: Path) -> str:
    """Return the SHA-256 of the content of an HDF5 artifact: names, units, dims, shapes, types, values; not its date.

    An artifact that is built again with the same numbers has the same digest, so nothing after it becomes stale.

    Raises
    ------
    OSError, RuntimeError, KeyError, ValueError
        If the file is damaged.
    """
    import h5py
    import numpy as np

    from mrpipe.artifacts.dimension_scales import SCALE_ATTRIBUTES, is_scale

    digest = hashlib.sha256()

    def visit(name: str, item: Any) -> None:
        if is_scale(item):
            return
        digest.update(name.encode())
        for key in sorted(item.attrs):
            if (name == "/" and key in _NOT_CONTENT) or key in SCALE_ATTRIBUTES:
                continue
            digest.update(f"{key}={item.attrs[key]!r}".encode())
        if isinstance(item, h5py.Dataset):
            digest.update(f"{item.dtype.str if item.dtype.kind != 'O' else 'text'}{item.shape}".encode())
            value = item[()]
            if isinstance(value, bytes):
                digest.update(value)
            elif item.dtype.kind == "O":  # texts of any length: the array holds pointers, not their content
                digest.update(repr(np.asarray(value).tolist()).encode())
            else:
                digest.update(np.ascontiguousarray(value).tobytes())

    with h5py.File(path, "r") as handle:
        visit("/", handle)
        names: list[str] = []
        handle.visit(names.append)
        for name in sorted(names):
            visit(name, handle[name])
    return digest.hexdigest()


class FileHashes:
    """Digests of files, remembered by size, times and inode, so that an unchanged gigabyte is read once.

    A file whose content changed keeps its size and may get its old time of modification back (`cp -p`, `rsync -t`); its
    time of status change and its inode show that it is another file.
    """

    def __init__(self, memory: Path) -> None:
        self._memory = memory
        try:
            known = json.loads(memory.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            known = None
        self._known: dict[str, Any] = known if isinstance(known, dict) else {}
        self._new: dict[str, Any] = {}

    def digest(self, path: Path) -> str:
        """Return the digest of a file, or of all files below a directory with their names; `missing` for neither.

        A damaged artifact has the digest of its bytes, so it differs from what was recorded when it was written.
        """
        if path.is_dir():
            return self.digest_many(sorted(item for item in path.rglob("*") if item.is_file()), path)
        try:
            stat = path.stat()
        except FileNotFoundError:
            return MISSING
        return self._remembered(str(path.resolve()), stat, lambda: _digest_of_file(path))

    def sha256(self, path: Path) -> str:
        """Return the SHA-256 of the bytes of a file, also of an artifact, as `sha256sum` prints it.

        Raises
        ------
        OSError
            If the file cannot be read.
        """
        from mrpipe.artifacts import sha256_of

        # only the digest of an artifact differs from that of its bytes
        key = f"{path.resolve()}{BYTES if path.suffix == '.h5' else ''}"
        return self._remembered(key, path.stat(), lambda: sha256_of(path))

    def _remembered(self, key: str, stat: os.stat_result, compute: Callable[[], str]) -> str:
        state = [stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino]
        entry = self._known.get(key)
        if isinstance(entry, list) and len(entry) == 5 and entry[:4] == state and isinstance(entry[4], str):
            return entry[4]
        value = compute()
        self.learn({key: [*state, value]})
        return value

    def digest_many(self, paths: Iterable[Path], base: Path) -> str:
        """Return one digest of several files: their names relative to `base` and their contents."""
        digest = hashlib.sha256()
        for path in paths:
            name = path.relative_to(base) if path.is_relative_to(base) else path.name
            digest.update(f"{name}\0{self.digest(path)}\n".encode())
        return digest.hexdigest()

    def save(self) -> None:
        """Write the digests to the memory file; if that is impossible, files are read again later.

        Its folder is not made for it, so that a command that only looks at a run directory does not make one.
        """
        if self._new and self._memory.parent.is_dir():
            from mrpipe.artifacts import atomic_write_text

            with suppress(OSError):
                atomic_write_text(self._memory, json.dumps(self._known))
            self._new = {}

    def learn(self, entries: Mapping[str, Any]) -> None:
        """Add digests of another process, as returned by its :meth:`take_new`."""
        self._known |= entries
        self._new |= entries

    def take_new(self) -> dict[str, Any]:
        """Return the digests that are new since the last call or :meth:`save`."""
        new, self._new = self._new, {}
        return new


def _digest_of_file(path: Path) -> str:
    from mrpipe.artifacts import sha256_of

    if path.suffix == ".h5":
        import h5py

        try:
            with h5py.File(path, "r") as handle:
                is_artifact = "mrpipe_version" in handle.attrs
            if is_artifact:
                return digest_of_artifact(path)
        except (OSError, RuntimeError, KeyError, ValueError):
            pass
    return sha256_of(path)


def plain_settings(config: Any, names: Iterable[str], hashes: FileHashes) -> dict[str, Any]:
    """Return dotted name -> JSON-able value of the named settings of a pydantic configuration.

    Every file that a setting names counts by its content, whatever the type of the setting: a ground motion that was
    edited is another ground motion.
    """
    content = config.model_dump(mode="json")
    chosen: dict[str, Any] = {}
    files: dict[str, str] = {}
    for name in names:
        value = content
        for part in name.split("."):
            value = value[part]
        chosen[name] = value
        files |= {str(path): hashes.digest(path)[:16] for path in files_in(value)}
    return {**chosen, "content of files": files} if files else chosen


def files_in(value: Any) -> Iterator[Path]:
    """Yield the files that texts at any depth of a setting name; a bare word is a name and no file."""
    if isinstance(value, str):
        path = Path(value)
        if (path.suffix or path.name != value) and _is_file(path):
            yield path
    elif isinstance(value, Mapping | list | tuple):
        for item in value.values() if isinstance(value, Mapping) else value:
            yield from files_in(item)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a text that no file system takes for a name
        return False


def flatten(value: Any, prefix: str = "") -> dict[str, Any]:
    """Return nested mappings as one mapping of dotted names."""
    if not isinstance(value, Mapping) or not value:
        return {prefix: value}
    flat: dict[str, Any] = {}
    for key, inner in value.items():
        flat.update(flatten(inner, f"{prefix}.{key}" if prefix else str(key)))
    return flat
