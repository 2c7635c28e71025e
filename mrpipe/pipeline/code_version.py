"""Hashes of all source files on which the result of a stage depends.

A stage's function imports modules; each of these imports others. Two dependencies are not imports and are declared in
the modules:

- `LOADS_FROM = ("mrpipe.effects", "mrpipe/exports/controller_template.c")` at the top level of a module names the
  packages that it walks at run time and the files of the program that it reads.
- `load_parameter_set("frames", ...)` reads `configs/frames`: the whole folder counts, or the one file where the call
  names it.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from mrpipe.artifacts import config_directory
from mrpipe.source_scan import imported_modules

_NO_RESULT = ("mrpipe.pipeline", "mrpipe.config", "mrpipe.cli", "mrpipe.reporting")
"""Packages that run, configure and draw. They change no results, so that an edited caption does not make a training
stale.
"""
_LOADS_FROM = re.compile(r"^LOADS_FROM(?::[^=\n]*)?\s*=\s*\(([^)]*)\)", re.MULTILINE)
_PARAMETER_SET = re.compile(r"""\bload_parameter_set\(\s*["']([\w-]+)["']\s*,\s*(?:["']([\w-]+)["'])?""")


@dataclass(frozen=True)
class _Source:
    """A module as its file says: hash, imported modules, and files of the program that it reads."""

    digest: str
    imports: tuple[str, ...]
    files: tuple[Path, ...]


def code_version(module: str) -> dict[str, str]:
    """Return module -> hash of its source for a module and all of mrpipe that it imports or walks, at any depth.

    Files of the program that these modules read are listed by their path (`configs/frames/thesis.yaml`).
    """
    found: dict[str, str] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in found or name.startswith(_NO_RESULT):
            continue
        source = _source(name)
        if source is None:
            continue
        found[name] = source.digest
        found |= {_label(path): _digest(path) for path in source.files}
        waiting.extend(source.imports)
    return found


@cache
def _source(name: str) -> _Source | None:
    path = _path_of(name)
    if path is None:
        return None
    content = path.read_bytes()
    text = content.decode("utf-8")
    imports = set(imported_modules(content, name, path.name == "__init__.py"))
    files: list[Path] = []
    for entry in _declared(text):
        if "/" in entry:
            files.extend(_files(_package().parent / entry))
        else:
            found = (item for folder in _folders(entry) for item in folder.glob("*.py"))
            imports |= {entry, *(f"{entry}.{item.stem}" for item in found)}
    for kind, one in _PARAMETER_SET.findall(text):
        folder = config_directory() / kind
        files.extend(_files(folder / f"{one}.yaml" if one else folder))
    return _Source(hashlib.sha256(content).hexdigest()[:16], tuple(sorted(imports)), tuple(files))


def _declared(text: str) -> list[str]:
    found = _LOADS_FROM.search(text)
    return re.findall(r"""["']([^"']+)["']""", found[1]) if found else []


def _files(path: Path) -> Iterator[Path]:
    if path.is_dir():
        yield from sorted(item for item in path.rglob("*") if item.is_file())
    elif path.is_file():
        yield path


@cache
def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _label(path: Path) -> str:
    for base, name in ((config_directory(), "configs"), (_package(), "mrpipe")):
        if path.is_relative_to(base):
            return f"{name}/{path.relative_to(base).as_posix()}"
    return str(path)


def _package() -> Path:
    return Path(__file__).resolve().parent.parent


def _folders(name: str) -> list[Path]:
    """Return the folders of a package: its own, and those that were appended to its `__path__`."""
    own = _package().joinpath(*name.split(".")[1:])
    imported = getattr(sys.modules.get(name), "__path__", ())
    return [own, *(Path(item) for item in imported if Path(item) != own)]


def _path_of(name: str) -> Path | None:
    """Find the source of a module without importing it; None if the module does not exist."""
    if name == "mrpipe":
        return _package() / "__init__.py"
    parent, _, own = name.rpartition(".")
    if parent.split(".")[0] != "mrpipe":
        return None
    candidates = (
        place for folder in _folders(parent) for place in (folder / f"{own}.py", folder / own / "__init__.py")
    )
    return next((item for item in candidates if item.is_file()), None)


def forget() -> None:
    """Clear the cache of sources, so that the next call reads them again."""
    _source.cache_clear()
    _digest.cache_clear()
