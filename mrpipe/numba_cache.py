"""Where numba keeps compiled code: one folder for each state of the sources that it was compiled from.

numba discards compiled code when the file of the function itself changes. It does not notice that a function of another
module changed which was compiled into the caller, so a simulation could run with a mixture of old and new code. The
folder is therefore named by a hash of all modules that hold compiled functions and of all modules that these import.
Any edit leads to another folder, and everything in it is compiled again.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

from mrpipe.source_scan import imported_modules

VARIABLE = "NUMBA_CACHE_DIR"
_PREFIX = "mrpipe-"
_KEPT_FOR_S = 30 * 86400.0
_KEPT_FOLDERS = 10
_SPARED_FOR_S = 86400.0
_COMPILED = re.compile(rb"^\s*(?:from|import)\s+numba\b", re.MULTILINE)


def use_keyed_cache() -> None:
    """Make numba use the folder of the present sources, now or as soon as numba is imported.

    The sources are read only when numba is needed, so that commands without computation start at once.
    """
    if "numba" in sys.modules:
        _point_numba_to(cache_folder())
    elif not any(isinstance(item, _BeforeNumba) for item in sys.meta_path):
        sys.meta_path.insert(0, _BeforeNumba())


class _BeforeNumba(MetaPathFinder):
    """Sets the cache folder at the first import of numba, then leaves the list of finders."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        del path, target
        if fullname == "numba":
            sys.meta_path.remove(self)
            _point_numba_to(cache_folder())
        return None


def compiled_sources(package: Path) -> list[Path]:
    """Return the modules of a package that hold compiled functions, and all modules that these import at any depth.

    Parameters
    ----------
    package
        Folder of the package `mrpipe`.
    """
    texts = {_module_of(path, package): (path, path.read_bytes()) for path in sorted(package.rglob("*.py"))}
    waiting = [name for name, (_, text) in texts.items() if name != __name__ and _COMPILED.search(text)]
    found = set(waiting)
    while waiting:
        name = waiting.pop()
        path, text = texts[name]
        # constants of an imported module may be part of compiled code
        new = {item for item in imported_modules(text, name, path.name == "__init__.py") if item in texts} - found
        found |= new
        waiting.extend(new)
    return sorted(texts[name][0] for name in found)


def has_compiled_functions(name: str) -> bool:
    """Return whether a module of the package imports numba."""
    parts = Path(__file__).resolve().parent.joinpath(*name.split(".")[1:])
    path = parts.with_suffix(".py") if parts.with_suffix(".py").is_file() else parts / "__init__.py"
    return name != __name__ and path.is_file() and _COMPILED.search(path.read_bytes()) is not None


def _module_of(path: Path, package: Path) -> str:
    parts = path.relative_to(package).with_suffix("").parts
    return ".".join(["mrpipe", *(parts[:-1] if parts[-1] == "__init__" else parts)])


def key_of(package: Path) -> str:
    """Return the hash of all compiled sources of a package."""
    digest = hashlib.sha256()
    for path in compiled_sources(package):
        digest.update(f"{path.relative_to(package).as_posix()}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def cache_folder() -> Path | None:
    """Return the folder of the present sources, made if missing; None where no folder can be written.

    A folder that the user names in `NUMBA_CACHE_DIR` is the parent; otherwise it is the user's cache directory, or a
    private temporary directory where that cannot be written. Folders of other sources are removed after a while.
    """
    name = _PREFIX + key_of(Path(__file__).resolve().parent)
    for parent in _parents():
        folder = parent / name
        try:
            new = not folder.is_dir()
            folder.mkdir(parents=True, exist_ok=True)
            if not os.access(folder, os.W_OK | os.X_OK):
                continue
            os.utime(folder)
        except OSError:
            continue
        if new:
            _remove_old(parent, folder)
        return folder
    return None


def _parents() -> Iterator[Path]:
    named = os.environ.get(VARIABLE)
    if named:
        given = Path(named)
        # a parent process has set the variable already: do not nest the folders
        yield given.parent if given.name.startswith(_PREFIX) else given
    caches = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    if caches:
        yield Path(caches) / "mrpipe" / "numba"
    elif home := os.path.expanduser("~"):  # noqa: PTH111 - Path.home() fails where no home directory is known
        yield Path(home) / ".cache" / "mrpipe" / "numba"
    private = Path(tempfile.gettempdir()) / f"mrpipe-numba-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    with suppress(OSError):
        private.mkdir(mode=0o700, exist_ok=True)
        # numba loads pickles from here: a folder that somebody else made is not used
        if not hasattr(os, "getuid") or (private.stat().st_uid == os.getuid() and not private.is_symlink()):
            yield private
    with suppress(OSError):
        temporary = Path(tempfile.mkdtemp(prefix="mrpipe-numba-"))
        atexit.register(shutil.rmtree, temporary, ignore_errors=True)
        yield temporary


def _remove_old(parent: Path, present: Path) -> None:
    """Remove the folders that no process has used for a month, and all but the latest that nobody used for a day."""
    used: dict[Path, float] = {}
    for folder in parent.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            if folder != present and folder.is_dir():
                used[folder] = folder.stat().st_mtime
    now = time.time()
    for place, folder in enumerate(sorted(used, key=lambda item: -used[item])):
        if now - used[folder] > (_KEPT_FOR_S if place < _KEPT_FOLDERS else _SPARED_FOR_S):
            shutil.rmtree(folder, ignore_errors=True)


def _point_numba_to(folder: Path | None) -> None:
    """Set the variable for this process and its children, and the configuration of numba where it is imported."""
    if folder is None:
        return
    os.environ[VARIABLE] = str(folder)
    numba = sys.modules.get("numba")
    if numba is not None:
        numba.config.CACHE_DIR = str(folder)


@contextmanager
def cache_for(name: str) -> Iterator[None]:
    """Keep the code that is compiled within this block in a separate folder.

    numba itself compares size and time of change of a file only, and both stay the same when a file is restored from a
    backup: the name of the folder of a user's own file is to contain a hash of its content.
    """
    import numba  # noqa: F401 - sets the folder of the package first

    before = os.environ.get(VARIABLE)
    if before is None:
        yield
        return
    _point_numba_to(Path(before) / name)
    try:
        yield
    finally:
        _point_numba_to(Path(before))
