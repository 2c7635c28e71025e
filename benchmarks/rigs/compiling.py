"""Compile the rigs' functions into a cache folder that is named by a hash of their sources.

numba does not notice that a function of another module changed which was compiled into the caller; another folder for
each state of the sources does.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba

import mrpipe  # noqa: F401 - sets the cache folder of the program's own compiled functions first

VARIABLE = "NUMBA_CACHE_DIR"


@cache
def _key() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@contextmanager
def _folder() -> Iterator[None]:
    before = os.environ.get(VARIABLE)
    if before is None:
        yield
        return
    os.environ[VARIABLE] = numba.config.CACHE_DIR = str(Path(before) / f"rigs-{_key()}")
    try:
        yield
    finally:
        os.environ[VARIABLE] = numba.config.CACHE_DIR = before


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function with numba."""
    with _folder():
        return numba.njit(cache=True)(function)
