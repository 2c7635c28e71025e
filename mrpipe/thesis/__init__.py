"""The ledger: every result and statement of the thesis, compared with what this program computes.

The names below are imported at first use, because the configuration needs the settings of this package only.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mrpipe.thesis.options import ReproduceSettings

if TYPE_CHECKING:
    from mrpipe.thesis.claim import Claim, Missing, Value, judge
    from mrpipe.thesis.collect import Ledger, build_ledger
    from mrpipe.thesis.entries import Entry, all_entries

LOADS_FROM: tuple[str, ...] = ()  # the modules loaded at first use are those imported above

__all__ = ["Claim", "Entry", "Ledger", "Missing", "ReproduceSettings", "Value", "all_entries", "build_ledger", "judge"]

_HOMES = {
    "Claim": "claim",
    "Missing": "claim",
    "Value": "claim",
    "judge": "claim",
    "Ledger": "collect",
    "build_ledger": "collect",
    "Entry": "entries",
    "all_entries": "entries",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
