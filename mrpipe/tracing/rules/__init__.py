"""Every threshold by which the tracing decides, with its unit, what it decides and why it has this value.

The classes are the sections `close_loop.rules.*` of the settings, so that each of them can be changed.
Each topic has its own module.
"""

from mrpipe.tracing.rules.campaign import LocationRules, TestabilityRules
from mrpipe.tracing.rules.loop import LoopRules
from mrpipe.tracing.rules.noise import ModelErrorRules, NoiseRules
from mrpipe.tracing.rules.race import RaceRules
from mrpipe.tracing.rules.sections import TracingRules
from mrpipe.tracing.rules.selection import BY_FORCE, RefinementRules, SelectionRules
from mrpipe.tracing.rules.sensors import NuisanceRules, OffsetRules
from mrpipe.tracing.rules.structure import BraceRules, DelayRules, FrameRules
from mrpipe.tracing.rules.validation import RemainderRules, ValidationRules

__all__ = [
    "BY_FORCE",
    "BraceRules",
    "DelayRules",
    "FrameRules",
    "LocationRules",
    "LoopRules",
    "ModelErrorRules",
    "NoiseRules",
    "NuisanceRules",
    "OffsetRules",
    "RaceRules",
    "RefinementRules",
    "RemainderRules",
    "SelectionRules",
    "TestabilityRules",
    "TracingRules",
    "ValidationRules",
]
