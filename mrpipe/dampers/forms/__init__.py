"""Base forms of a damper, one file each; :mod:`mrpipe.dampers.library` loads the modules of this package."""

from __future__ import annotations

import pkgutil

DEFAULT_FORM = "bouc-wen"
"""The thesis' simplified Bouc-Wen model (2.1) to (2.4)."""

LOADS_FROM: tuple[str, ...] = ()  # only names are read here; mrpipe.dampers.library loads the files


def form_names() -> tuple[str, ...]:
    """Return the names of all forms without loading them: a file `bouc_wen.py` defines the form `bouc-wen`."""
    return tuple(item.name.replace("_", "-") for item in pkgutil.iter_modules(__path__))
