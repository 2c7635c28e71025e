"""Inputs of the stages that run or export the closed loop, which depend on the damper and on the inverse."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mrpipe.pipeline.stage import Stage

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings

LOOP_INPUTS = (
    ("simulate.damper", "identified", "identify-damper"),
    ("simulate.damper", "traced", "identify-damper"),
    ("simulate.damper", "traced", "close-loop"),
    ("simulate.controller.inverse", "network", "train-inverse"),
)
"""Conditional inputs of a stage: a loop with a damper from a parameter set and the inverse of its model needs no bench
tests."""


def variant_for_dampers(stage: Stage, configuration: RunSettings) -> Stage | None:
    """Return the variant of a stage for a structure with several dampers, None if the configuration has none.

    The damper model is one of its inputs if a damper of the structure is the identified one.

    Parameters
    ----------
    stage
        Stage for several dampers, which reads the frame first.
    configuration
        The whole configuration.
    """
    structure, settings = (getattr(configuration, name, None) for name in ("structure", "calibrate"))
    if structure is None or settings is None or not structure.dampers:
        return None
    if any((entry.damper or settings.damper) == "identified" for entry in structure.dampers):
        return replace(stage, inputs=(stage.inputs[0], "identify-damper", *stage.inputs[1:]))
    return stage
