"""Content hashes of everything a result depends on: files, artifacts, settings and code."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

# running, configuring and the command line change no result
_NOT_CODE = ("mrpipe.pipeline", "mrpipe.config", "mrpipe.cli")
# told by the artifact about its making, not part of what it says
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
    """Return the SHA-256 of what an HDF5 artifact says: names, units, dims and numbers, not when it was made.

    An artifact that is built again with the same numbers has the same digest, so nothing after it becomes stale.
    """
    import h5py
    import numpy as np

    digest = hashlib.sha256()

    def visit(name: str, item: Any) -> None:
        digest.update(name.encode())
        for key in sorted(item.attrs):
            if name == "/" and key in _NOT_CONTENT:
                continue
            digest.update(f"{key}={item.attrs[key]!r}".encode())
        if isinstance(item, h5py.Dataset):
            value = item[()]
            digest.update(value if isinstance(value, bytes) else np.ascontiguousarray(value).tobytes())

    with h5py.File(path, "r") as handle:
        visit("/", handle)
        names: list[str] = []
        handle.visit(names.append)
        for name in sorted(names):
            visit(name, handle[name])
    return digest.hexdigest()


class FileHashes:
    """Digests of files, remembered by size and time of change, so that an unchanged gigabyte is read once."""

    def __init__(self, memory: Path) -> None:
        self._memory = memory
        try:
            self._known: dict[str, list[Any]] = json.loads(memory.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            self._known = {}
        self._changed = False

    def digest(self, path: Path) -> str:
        """Return the digest of a file, or of all files below a directory with their names."""
        if path.is_dir():
            return self.digest_many(sorted(item for item in path.rglob("*") if item.is_file()), path)
        stat = path.stat()
        key = str(path.resolve())
        entry = self._known.get(key)
        if entry is not None and entry[:2] == [stat.st_size, stat.st_mtime_ns]:
            return str(entry[2])
        from mrpipe.artifacts import sha256_of

        value = digest_of_artifact(path) if _is_artifact(path) else sha256_of(path)
        self._known[key] = [stat.st_size, stat.st_mtime_ns, value]
        self._changed = True
        return value

    def digest_many(self, paths: Iterable[Path], base: Path) -> str:
        """Return one digest of several files: their names relative to `base` and their contents."""
        digest = hashlib.sha256()
        for path in paths:
            name = path.relative_to(base) if path.is_relative_to(base) else path.name
            digest.update(f"{name}\0{self.digest(path)}\n".encode())
        return digest.hexdigest()

    def save(self) -> None:
        """Write what was learnt to the memory file."""
        if self._changed:
            from mrpipe.artifacts import atomic_write_text

            atomic_write_text(self._memory, json.dumps(self._known))
            self._changed = False


def _is_artifact(path: Path) -> bool:
    if path.suffix != ".h5":
        return False
    import h5py

    try:
        with h5py.File(path, "r") as handle:
            return "mrpipe_version" in handle.attrs
    except OSError:
        return False


def plain_settings(config: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return dotted name -> JSON-able value of the named settings of a pydantic configuration.

    Files that they name count by their content: a user's own effect that was edited is another effect.
    """
    content, typed = config.model_dump(mode="json"), config.model_dump()
    chosen: dict[str, Any] = {}
    files: dict[str, str] = {}
    for name in names:
        value, same = content, typed
        for part in name.split("."):
            value, same = value[part], same[part]
        chosen[name] = value
        files |= {str(path): hashlib.sha256(path.read_bytes()).hexdigest()[:16] for path in _files_in(same)}
    return {**chosen, "content of files": files} if files else chosen


def _files_in(value: Any) -> list[Path]:
    if isinstance(value, Path):
        return [value] if value.is_file() else []
    inner = value.values() if isinstance(value, Mapping) else value if isinstance(value, list | tuple) else ()
    return [path for item in inner for path in _files_in(item)]


def flatten(value: Any, prefix: str = "") -> dict[str, Any]:
    """Return nested mappings as one mapping of dotted names."""
    if not isinstance(value, Mapping) or not value:
        return {prefix: value}
    flat: dict[str, Any] = {}
    for key, inner in value.items():
        flat.update(flatten(inner, f"{prefix}.{key}" if prefix else str(key)))
    return flat


@cache
def code_version(module: str, further: tuple[str, ...] = ()) -> dict[str, str]:
    """Return module -> hash of source for a module and all of mrpipe that it imports, at any depth."""
    found: dict[str, str] = {}
    waiting = [module, *further]
    while waiting:
        name = waiting.pop()
        if name in found or name.startswith(_NOT_CODE):
            continue
        source = _source_of(name)
        if source is None:
            continue
        text = source.read_bytes()
        found[name] = hashlib.sha256(text).hexdigest()[:16]
        waiting.extend(_imports_of(text.decode("utf-8"), name, source.name == "__init__.py"))
    return found


def _source_of(name: str) -> Path | None:
    """Find the source of a module without importing it; None if there is no such module."""
    root = importlib.util.find_spec("mrpipe")
    if root is None or not root.submodule_search_locations:
        return None
    base = Path(root.submodule_search_locations[0]).joinpath(*name.split(".")[1:])
    for candidate in (base.with_suffix(".py"), base / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def _imports_of(text: str, module: str, is_package: bool) -> list[str]:
    package = module if is_package else module.rpartition(".")[0]
    names: list[str] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names.extend(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parent = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*parent, *([node.module] if node.module else [])])
            names.append(base)
            names.extend(f"{base}.{alias.name}" for alias in node.names)
    return [name for name in names if name == "mrpipe" or name.startswith("mrpipe.")]
