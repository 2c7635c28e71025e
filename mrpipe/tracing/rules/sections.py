"""All sections of `close_loop.rules`."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section
from mrpipe.tracing.rules.campaign import LocationRules, TestabilityRules
from mrpipe.tracing.rules.loop import LoopRules
from mrpipe.tracing.rules.noise import ModelErrorRules, NoiseRules
from mrpipe.tracing.rules.race import RaceRules
from mrpipe.tracing.rules.selection import BY_FORCE, RefinementRules, SelectionRules
from mrpipe.tracing.rules.sensors import NuisanceRules, OffsetRules
from mrpipe.tracing.rules.structure import BraceRules, DelayRules, FrameRules
from mrpipe.tracing.rules.validation import RemainderRules, ValidationRules


class TracingRules(Section):
    """Thresholds of the decisions of `close-loop`."""

    validation: ValidationRules = Field(
        ValidationRules(), description="How errors on the validation tests decide the class of the verdict."
    )
    selection: SelectionRules = Field(SelectionRules(), description="When forward selection adds and names an effect.")
    selection_by_force: SelectionRules = Field(
        BY_FORCE,
        description="The same for weights relative to the RMS force, where any model's error exceeds the noise.",
    )
    race: RaceRules = Field(RaceRules(), description="How base forms with and without effects are compared.")
    model_error: ModelErrorRules = Field(ModelErrorRules(), description="When the sensors' noise is not the measure.")
    refinement: RefinementRules = Field(RefinementRules(), description="When a richer form of an effect is taken.")
    remainder: RemainderRules = Field(RemainderRules(), description="When something remains unexplained.")
    noise: NoiseRules = Field(NoiseRules(), description="How the noise of a bench campaign is estimated.")
    offsets: OffsetRules = Field(OffsetRules(), description="When a moving zero of the load cell is named.")
    nuisances: NuisanceRules = Field(NuisanceRules(), description="When gains of sessions and filters are real.")
    testability: TestabilityRules = Field(TestabilityRules(), description="When a campaign can show an effect.")
    location: LocationRules = Field(LocationRules(), description="How the report divides the residual.")
    frame: FrameRules = Field(FrameRules(), description="How the residual of a linear frame is judged.")
    brace: BraceRules = Field(BraceRules(), description="When a flexible brace of the damper is named.")
    delay: DelayRules = Field(DelayRules(), description="When a controller is called late.")
    loop: LoopRules = Field(LoopRules(), description="How the closed loop is compared with and without the effects.")
