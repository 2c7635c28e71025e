"""From measured magnetorheological dampers to a closed-loop run, and back to the effect that a model lacks."""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

from mrpipe.numba_cache import use_keyed_cache

__version__ = "0.1.0"

LOADS_FROM: tuple[str, ...] = ()  # the interface for notebooks is not a part of any stage

use_keyed_cache()


def __getattr__(name: str) -> Any:
    """Load the Python interface (:mod:`mrpipe.api`) at first use: it needs numba, and the command line starts fast."""
    # a module of the package is imported without the interface
    if not name.startswith("_") and importlib.util.find_spec(f"{__name__}.{name}") is None:
        interface = importlib.import_module(f"{__name__}.api")
        if name in interface.__all__:
            return getattr(interface, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of the module and of the interface, for completion in notebooks."""
    return sorted({*globals(), *importlib.import_module(f"{__name__}.api").__all__})
