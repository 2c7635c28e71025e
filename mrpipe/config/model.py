"""The whole configuration: the settings of the run and one section for each module of `config/sections`.

A section adds itself: the module `sections/train_forward.py` holds the class `TrainForwardSettings`, which becomes the
section `train_forward`; the first line of its docstring is the section's description. Modules whose names begin with an
underscore hold what several sections share.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import BaseModel, Field, create_model, field_validator

import mrpipe.config.sections
from mrpipe.config.errors import model_in
from mrpipe.config.sections.campaigns import CampaignsSettings
from mrpipe.config.sections.execution import ExecutionSettings
from mrpipe.config.sections.report import ReportSettings
from mrpipe.options import Section

DEFAULT_STAGES = (
    "record-bench",
    "record-frame",
    "prepare",
    "assemble",
    "sweep",
    "train-forward",
    "train-inverse",
    "identify-damper",
    "identify-frame",
    "calibrate",
    "simulate-vd",
    "simulate-vdps",
    "simulate-vdns",
    "simulate-fdns",
    "simulate-passive-off",
    "simulate-passive-on",
    "record-closed-loop",
    "close-loop",
    "report",
)


class RunSettings(Section):
    """General settings of a run; the sections of the stages are added by name (:func:`config_model`)."""

    name: str = Field("", description="Name of the run; its directory is runs/<name> unless --run gives another one.")
    description: str = Field("", description="Purpose of this configuration, a sentence for the report.")
    seed: int = Field(
        2011,
        ge=0,
        le=2**63 - 1,
        description="Seed of all random numbers; the same inputs and seed give the same results.",
    )
    stages: tuple[str, ...] = Field(
        DEFAULT_STAGES,
        min_length=1,
        description="Stages of `mrpipe run`, by name; the stages that they need are built too.",
    )
    campaigns: CampaignsSettings = Field(CampaignsSettings(), description="Sources of the measurements.")
    report: ReportSettings = Field(ReportSettings(), description="The report.")
    execution: ExecutionSettings = Field(
        ExecutionSettings(),
        description="Execution of the program; these settings change no result, and no stage becomes out of date.",
    )

    @field_validator("stages")
    @classmethod
    def _each_once(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        twice = sorted({name for name in value if value.count(name) > 1})
        if twice:
            raise ValueError(f"every stage once expected; {', '.join(twice)} is listed more than once")
        return value


@cache
def sections() -> dict[str, type[Section]]:
    """Return name -> model of every section of a stage, in the order of the default stages, then by name.

    Raises
    ------
    ValueError
        If a module of the folder holds no class of the expected name.
    """
    found: dict[str, type[Section]] = {}
    for item in pkgutil.iter_modules(mrpipe.config.sections.__path__):
        if item.name.startswith("_") or item.name in RunSettings.model_fields:
            continue
        module = importlib.import_module(f"mrpipe.config.sections.{item.name}")
        expected = "".join(part.capitalize() for part in item.name.split("_")) + "Settings"
        if not hasattr(module, expected):
            raise ValueError(f"{module.__name__} holds no class {expected}")
        found[item.name] = getattr(module, expected)
    return dict(sorted(found.items(), key=lambda entry: (_place(entry[0]), entry[0])))


def _place(section: str) -> int:
    name = section.replace("_", "-")
    known = [index for index, stage in enumerate(DEFAULT_STAGES) if stage == name or stage.startswith(f"{name}-")]
    return min(known, default=len(DEFAULT_STAGES))


@cache
def config_model() -> type[RunSettings]:
    """Return the model of the whole configuration: the settings of the run and every section."""
    fields: dict[str, Any] = {
        name: (model, Field(model(), description=(model.__doc__ or "").strip().splitlines()[0]))
        for name, model in sections().items()
    }
    return create_model("Config", __base__=RunSettings, __doc__="Everything that can be set.", **fields)


def forget() -> None:
    """Forget the sections found, so that the next call looks into the folder again."""
    sections.cache_clear()
    config_model.cache_clear()


def options(model: type[BaseModel] | None = None, prefix: str = "") -> Iterator[tuple[str, str, Any]]:
    """Yield (dotted name, description, default) of every setting, sections first; `[]` marks the items of a list."""
    for name, field in (model or config_model()).model_fields.items():
        dotted = f"{prefix}{name}"
        yield dotted, field.description or "", field.get_default(call_default_factory=True)
        inner = model_in(field.annotation)
        if inner is not None:
            yield from options(inner, f"{dotted}." if field.annotation is inner else f"{dotted}[].")
