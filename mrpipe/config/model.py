"""The whole configuration."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, Field

from mrpipe.config.errors import model_in
from mrpipe.config.section import Section
from mrpipe.config.sections.assemble import AssembleSettings
from mrpipe.config.sections.benchmark import BenchmarkSettings
from mrpipe.config.sections.calibrate import CalibrateSettings
from mrpipe.config.sections.campaigns import CampaignsSettings
from mrpipe.config.sections.close_loop import CloseLoopSettings
from mrpipe.config.sections.execution import ExecutionSettings
from mrpipe.config.sections.export import ExportSettings
from mrpipe.config.sections.identify_damper import IdentifyDamperSettings
from mrpipe.config.sections.identify_frame import IdentifyFrameSettings
from mrpipe.config.sections.laboratory import LaboratorySettings
from mrpipe.config.sections.prepare import PrepareSettings
from mrpipe.config.sections.report import ReportSettings
from mrpipe.config.sections.reproduce import ReproduceSettings
from mrpipe.config.sections.simulate import SimulateSettings
from mrpipe.config.sections.sweep import SweepSettings
from mrpipe.config.sections.train_forward import TrainForwardSettings
from mrpipe.config.sections.train_inverse import TrainInverseSettings

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


class Config(Section):
    """Everything that can be set, a section a stage; defaults are the thesis' own run on the virtual laboratory."""

    name: str = Field("", description="Name of the run: its directory is runs/<name> unless --run says otherwise.")
    description: str = Field("", description="What this configuration is for, in a sentence; shown in the report.")
    seed: int = Field(2011, ge=0, description="Seed of all randomness; the same inputs and seed give the same numbers.")
    stages: tuple[str, ...] = Field(
        DEFAULT_STAGES, description="Stages of `mrpipe run`, by name; what they need is built too."
    )
    campaigns: CampaignsSettings = Field(CampaignsSettings(), description="Where the measurements come from.")
    laboratory: LaboratorySettings = Field(LaboratorySettings(), description="The virtual rig.")
    prepare: PrepareSettings = Field(PrepareSettings(), description="Filtering, offsets, differentiation, cycles.")
    assemble: AssembleSettings = Field(AssembleSettings(), description="The training set.")
    sweep: SweepSettings = Field(SweepSettings(), description="The architecture sweep.")
    train_forward: TrainForwardSettings = Field(TrainForwardSettings(), description="The forward network.")
    train_inverse: TrainInverseSettings = Field(TrainInverseSettings(), description="The inverse network.")
    identify_damper: IdentifyDamperSettings = Field(IdentifyDamperSettings(), description="The parametric damper.")
    identify_frame: IdentifyFrameSettings = Field(IdentifyFrameSettings(), description="The frame's M, C, K and modes.")
    calibrate: CalibrateSettings = Field(CalibrateSettings(), description="Gains of the control laws.")
    simulate: SimulateSettings = Field(SimulateSettings(), description="The closed loop.")
    close_loop: CloseLoopSettings = Field(CloseLoopSettings(), description="From residual to missing effect.")
    benchmark: BenchmarkSettings = Field(BenchmarkSettings(), description="The benchmark structures of chapter 6.")
    reproduce: ReproduceSettings = Field(ReproduceSettings(), description="The thesis' figures beside ours.")
    export: ExportSettings = Field(ExportSettings(), description="The controller as C.")
    report: ReportSettings = Field(ReportSettings(), description="The report.")
    execution: ExecutionSettings = Field(
        ExecutionSettings(), description="How the program runs; changes no result and makes no stage stale."
    )


def options(model: type[BaseModel] = Config, prefix: str = "") -> Iterator[tuple[str, str, Any]]:
    """Yield (dotted name, description, default) of every setting, sections first; `[]` marks the items of a list."""
    for name, field in model.model_fields.items():
        dotted = f"{prefix}{name}"
        yield dotted, field.description or "", field.get_default(call_default_factory=True)
        inner = model_in(field.annotation)
        if inner is not None:
            yield from options(inner, f"{dotted}." if field.annotation is inner else f"{dotted}[].")
