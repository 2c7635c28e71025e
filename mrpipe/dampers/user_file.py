"""Loading of a Python file of a user as a module, with a separate cache for compiled code."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import traceback
from pathlib import Path
from types import ModuleType

from mrpipe.errors import UserError
from mrpipe.numba_cache import cache_for


def check_is_file(path: Path, setting: str, remedy: str) -> None:
    """Raise a UserError if the file does not exist; arguments as in :func:`module_of_file`."""
    if not path.is_file():
        raise UserError(path, setting, "no such file", remedy)


def module_of_file(path: Path, setting: str, remedy: str) -> ModuleType:
    """Return the module of a file; its name contains a hash of the content, so that an edited file is a new module.

    Parameters
    ----------
    path
        File to be loaded.
    setting, remedy
        Setting that names the file, and remedy, for messages.

    Raises
    ------
    UserError
        If the file is missing or cannot be run.
    """
    check_is_file(path, setting, remedy)
    source = path.read_bytes()
    name = f"mrpipe_user_{path.stem}_{hashlib.sha256(source).hexdigest()[:16]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise UserError(path, setting, "is not a Python file", remedy)
    module = importlib.util.module_from_spec(spec)
    # compiled code that is loaded from the cache looks for its module by name
    sys.modules[name] = module
    try:
        with cache_for(name):
            # the import loader is not used, because its byte code counts as current if size and second of the last
            # change agree
            exec(compile(source, str(path), "exec"), module.__dict__)
    except Exception as error:
        del sys.modules[name]
        # messages of a compiler are long: the first line names the fault
        said = next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
        line = _line(error, path)
        where = ", ".join(filter(None, (setting, f"line {line}" if line else "")))
        raise UserError(path, where, f"cannot be run: {said}", "correct the file") from error
    return module


def _line(error: Exception, path: Path) -> int:
    """Return the last line of the file that led to an error; 0 if none is known."""
    if isinstance(error, SyntaxError):
        return error.lineno or 0
    lines = [frame.lineno or 0 for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return lines[-1] if lines else 0
