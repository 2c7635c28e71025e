"""The declared settings of a stage, without all others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel


def setting_named(config: BaseModel, dotted: str) -> Any:
    """Return the section or value of a dotted name."""
    value: Any = config
    for part in dotted.split("."):
        value = getattr(value, part)
    return value


class SettingsView:
    """Attribute access to declared settings; others raise LookupError, as they are not in the cache key."""

    def __init__(self, target: Any, declared: Sequence[str], stage: str, prefix: str = "") -> None:
        self._target = target
        self._declared = tuple(declared)
        self._stage = stage
        self._prefix = prefix

    def __getattr__(self, name: str) -> Any:
        dotted = f"{self._prefix}{name}"
        value = getattr(self._target, name)
        if any(dotted == item or dotted.startswith(f"{item}.") for item in self._declared):
            return value
        if any(item.startswith(f"{dotted}.") for item in self._declared):
            return SettingsView(value, self._declared, self._stage, f"{dotted}.")
        raise LookupError(f"stage {self._stage} reads {dotted} but does not declare it")
