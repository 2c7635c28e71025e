"""A pipeline of three small stages, so that its rules are tested without hours of numerics."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.config.loader import LoadedConfig
from mrpipe.config.model import config_model
from mrpipe.errors import StageSkipped
from mrpipe.pipeline.runner import Pipeline
from mrpipe.pipeline.stage import Stage, StageContext

CALLS: list[str] = []


def _first(context: StageContext) -> Mapping[str, Any]:
    CALLS.append("first")
    with context.write("first.h5") as artifact:
        artifact.put("values", context.rng.normal(size=5), unit="m", dims=("time",))
        artifact.put("cutoff", context.settings.prepare.cutoff_hz, unit="Hz")
    context.warn("the first is only a test")
    return {"rms_m": np.float64(1.5), "not_finite": float("nan")}


def _second(context: StageContext) -> Mapping[str, Any]:
    CALLS.append("second")
    values = context.artifact("first").array("values")
    with context.write("second.h5") as artifact:
        artifact.put("doubled", 2 * values, unit="m", dims=("time",))
    context.report.text("Twice as much.")
    return {"sum_m": float(np.sum(2 * values))}


def _third(context: StageContext) -> Mapping[str, Any]:
    CALLS.append("third")
    if "second" not in context.inputs:
        raise StageSkipped("no second")
    with context.write("third.h5") as artifact:
        artifact.put("one", 1.0, unit="1")
    return {}


STAGES = {
    "first": Stage("first", "makes numbers", _first, settings=("prepare.cutoff_hz",), outputs=("first.h5",)),
    "second": Stage("second", "doubles", _second, inputs=("first",), outputs=("second.h5",)),
    "third": Stage("third", "ends", _third, optional_inputs=("second",), outputs=("third.h5",)),
    "shaken": Stage("shaken", "needs a frame", _second, inputs=("campaign:frame",), outputs=("shaken.h5",)),
    "after": Stage("after", "needs what was shaken", _second, inputs=("shaken",), outputs=("after.h5",)),
}

MakePipeline = Callable[..., Pipeline]


@pytest.fixture
def make_pipeline(tmp_path: Path) -> MakePipeline:
    """Return a function that makes a pipeline in one run directory; changes of the configuration are arguments."""
    CALLS.clear()

    def make(stages: Mapping[str, Stage] | None = None, **changes: Any) -> Pipeline:
        content = {"campaigns": {"bench": None, "frame": None, "closed_loop": None}, **changes}
        loaded = LoadedConfig(config_model().model_validate(content), tmp_path / "config.yaml")
        return Pipeline(loaded, stages or STAGES, tmp_path / "run", logging.getLogger("test"), quiet=True)

    return make


def with_run(name: str, run: Callable[[StageContext], Mapping[str, Any]]) -> dict[str, Stage]:
    """Return the stages with another function for one of them."""
    return {**STAGES, name: replace(STAGES[name], run=run)}
