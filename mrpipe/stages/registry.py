"""All stages by name, in the order of the pipeline."""

from __future__ import annotations

import importlib
from functools import cache

from mrpipe.errors import UserError
from mrpipe.pipeline.stage import Stage

_MODULES = (
    "record",
    "prepare",
    "assemble",
    "sweep",
    "train_forward",
    "train_inverse",
    "identify_damper",
    "identify_frame",
    "calibrate",
    "simulate",
    "close_loop",
    "benchmark",
    "reproduce",
    "export_controller",
)


@cache
def all_stages() -> dict[str, Stage]:
    """Return name -> stage in the order of the pipeline."""
    stages: list[Stage] = []
    for name in _MODULES:
        module = importlib.import_module(f"mrpipe.stages.{name}")
        stages.extend(getattr(module, "STAGES", None) or (module.STAGE,))
    # the closed loop is recorded with a calibrated controller, so it comes after it though its file comes first
    names = [stage.name for stage in stages if stage.name != "record-closed-loop"]
    names.insert(names.index("close-loop"), "record-closed-loop")
    return {stage.name: stage for stage in sorted(stages, key=lambda item: names.index(item.name))}


def stage_named(name: str) -> Stage:
    """Return one stage.

    Raises
    ------
    UserError
        If there is no such stage; the nearest name is given.
    """
    from mrpipe.artifacts.yaml_source import nearest

    stages = all_stages()
    if name not in stages:
        raise UserError("stages", name, "no such stage", nearest(name, list(stages)))
    return stages[name]
