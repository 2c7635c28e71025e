"""From measured magnetorheological dampers to a closed-loop run, and back to the effect that a model lacks."""

from __future__ import annotations

import importlib
from typing import Any

from mrpipe.numba_cache import use_keyed_cache

__version__ = "0.1.0"

LOADS_FROM: tuple[str, ...] = ()  # the interface for notebooks is not a part of any stage

_INTERFACE = (
    "NetworkRegressor",
    "design",
    "export",
    "fit_damper",
    "identify_frame",
    "load_campaign",
    "network_rows",
    "open_run",
    "prepare",
    "simulate",
    "trace",
)
"""Names of :mod:`mrpipe.api`, which type checkers know; they are offered here for notebooks."""

use_keyed_cache()


def __getattr__(name: str) -> Any:
    """Load the Python interface at first use, because it needs numba and the command line must start fast."""
    if name not in _INTERFACE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module("mrpipe.api"), name)
