"""All stages by name, in the order of the pipeline.

A stage registers itself: every module of this folder that defines `STAGE` (or `STAGES`) belongs to the pipeline. The
order follows from the inputs of each stage and from its `after`.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Mapping
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING

import mrpipe.stages
from mrpipe.errors import UserError
from mrpipe.pipeline.stage import Stage

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings

RECORDERS = {
    "campaign:bench": "record-bench",
    "campaign:frame": "record-frame",
    "campaign:closed-loop": "record-closed-loop",
}
"""Input -> stage with which the virtual laboratory records this campaign."""


@cache
def _modules() -> tuple[ModuleType, ...]:
    names = sorted(item.name for item in pkgutil.iter_modules(mrpipe.stages.__path__) if item.name != "registry")
    return tuple(importlib.import_module(f"mrpipe.stages.{name}") for name in names)


@cache
def all_stages() -> dict[str, Stage]:
    """Return name -> stage in the order of the pipeline."""
    found: list[Stage] = []
    for module in _modules():
        found.extend(getattr(module, "STAGES", None) or ([module.STAGE] if hasattr(module, "STAGE") else []))
    return in_order(found)


def forget() -> None:
    """Clear the list of stages, so that the next call searches the folder again."""
    _modules.cache_clear()
    all_stages.cache_clear()


def in_order(stages: Iterable[Stage]) -> dict[str, Stage]:
    """Return name -> stage, each after all that it reads and all that its `after` names; else in the order given.

    Raises
    ------
    ValueError
        If two stages have the same name, a stage reads one that does not exist, or stages wait for each other.
    """
    waiting: dict[str, Stage] = {}
    for stage in stages:
        if stage.name in waiting:
            raise ValueError(f"two stages have the name {stage.name}")
        waiting[stage.name] = stage
    before = {name: _before(stage, waiting) for name, stage in waiting.items()}
    ordered: dict[str, Stage] = {}
    while waiting:
        ready = next((name for name in waiting if before[name] <= set(ordered)), None)
        if ready is None:
            raise ValueError(f"these stages wait for each other: {', '.join(waiting)}")
        ordered[ready] = waiting.pop(ready)
    return ordered


def _before(stage: Stage, known: Mapping[str, Stage]) -> set[str]:
    names: set[str] = set()
    for item in stage.all_inputs:
        name = RECORDERS.get(item, item)
        if name not in known and item not in RECORDERS:
            raise ValueError(f"stage {stage.name} reads {name}, which is not a stage")
        names.add(name)
    for item in stage.after:
        names |= {item} | {other.name for other in known.values() if other.family == item}
    return {name for name in names if name in known and name != stage.name}


def stages_for(configuration: RunSettings, given: str = "") -> dict[str, Stage]:
    """Return the stages that suit a configuration.

    A module may define `variant(configuration, given)`. It returns a stage that replaces the stage of the same name, or
    None.

    Parameters
    ----------
    configuration
        The whole configuration.
    given
        Entry of `campaigns` that the user named on the command line, empty for none.
    """
    stages = dict(all_stages())
    for module in _modules():
        variant = module.variant(configuration, given) if hasattr(module, "variant") else None
        if variant is not None:
            stages[variant.name] = variant
    return stages


def stage_named(name: str) -> Stage:
    """Return one stage.

    Raises
    ------
    UserError
        If no such stage exists; the message names the most similar one.
    """
    from mrpipe.artifacts.yaml_source import nearest

    stages = all_stages()
    if name not in stages:
        raise UserError("stages", name, "no such stage", nearest(name, list(stages)))
    return stages[name]
