"""Compilation of the functions of later stages in a second process, while the first stages run.

numba compiles a function when its module is imported for the first time and keeps the result in a cache. In the first
run on a machine, every stage would wait for the compiler. Results do not depend on it: a function that is not in the
cache yet is compiled where it is needed.
"""

from __future__ import annotations

import hashlib
import importlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from mrpipe.numba_cache import cache_folder, has_compiled_functions
from mrpipe.pipeline.code_version import code_version

LIBRARIES = ("matplotlib.figure", "matplotlib.backends.backend_svg", "scipy.stats", "sklearn.neural_network")
"""Libraries of later stages whose first import on a machine takes seconds, because Python compiles them to bytecode."""

NICENESS = 5
"""Increment of the process priority value (nice) of the compiler, so that the running stages have priority."""


def modules_of(stage_modules: Iterable[str]) -> list[str]:
    """Return the modules with compiled functions that stages import, in the order of the stages.

    Parameters
    ----------
    stage_modules
        Names of the modules that define the stages.
    """
    found: dict[str, None] = {}
    for stage in dict.fromkeys(stage_modules):
        names = (name for name in code_version(stage) if name.startswith("mrpipe."))
        found |= dict.fromkeys(name for name in names if has_compiled_functions(name))
    return list(found)


@contextmanager
def compiled_ahead(stage_modules: Sequence[str], jobs: int) -> Iterator[Callable[[], bool]]:
    """Compile what stages need in a second process during the block; it ends with the block.

    Yields a function that returns whether the process is still running.

    Nothing is started with one process only, or if the same modules were compiled before.

    Parameters
    ----------
    stage_modules
        Names of the modules that define the stages.
    jobs
        Processes that may be used.
    """
    process = _started(modules_of(stage_modules)) if jobs > 1 else None
    try:
        yield lambda: process is not None and process.poll() is None
    finally:
        if process is not None:
            process.terminate()
            process.wait()


def _started(modules: Sequence[str]) -> subprocess.Popen[bytes] | None:
    mark = _mark(modules)
    if mark is None or mark.exists():
        return None
    command = [sys.executable, "-m", __name__, *modules]
    nothing = subprocess.DEVNULL
    try:
        return subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing)
    except OSError:
        return None


def _mark(modules: Sequence[str]) -> Path | None:
    """Return the file that marks these modules as compiled in the cache; None without a cache.

    numba keeps the code of every copy of the sources separately, so the file is named by the place of this copy too.
    """
    folder = cache_folder()
    if folder is None:
        return None
    named_by = " ".join([str(Path(__file__).resolve()), *modules])
    return folder / f"compiled-{hashlib.sha256(named_by.encode()).hexdigest()[:16]}"


def main(modules: Sequence[str]) -> None:
    """Import modules, which compiles their functions, and mark them as compiled."""
    with suppress(AttributeError, OSError):
        os.nice(NICENESS)
    for name in LIBRARIES:
        importlib.import_module(name)
    for name in modules:
        importlib.import_module(name)
    mark = _mark(modules)
    if mark is not None:
        mark.touch()


if __name__ == "__main__":
    main(sys.argv[1:])
