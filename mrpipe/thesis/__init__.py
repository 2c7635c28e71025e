"""Every printed figure of the thesis, compared with what this program computes; one module per chapter.

The names below are imported at first use, because the configuration needs the settings of this package only.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mrpipe.thesis.options import ReproduceSettings

if TYPE_CHECKING:
    from mrpipe.thesis.claim import Claim, Number, cannot, compare
    from mrpipe.thesis.collect import collect_claims

LOADS_FROM: tuple[str, ...] = ()  # the modules loaded at first use are those imported above

__all__ = ["Claim", "Number", "ReproduceSettings", "cannot", "collect_claims", "compare"]

_HOMES = {"Claim": "claim", "Number": "claim", "cannot": "claim", "compare": "claim", "collect_claims": "collect"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
